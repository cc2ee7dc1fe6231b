//! The longest path through code of which traces are known: an upper bound of what any tick can cost that takes the branches seen,
//! in any combination (implicit path enumeration: Li and Malik, 1995).

use std::collections::BTreeMap;

use anyhow::{Result, bail};
use microlp::{ComparisonOp, OptimizationDirection, Problem, SolveOutcome};

/// Transitions from instruction to instruction, each by the largest number of times that one trace takes it.
#[derive(Default)]
pub(crate) struct Transitions {
    most: BTreeMap<(u32, u32), u32>,
}

/// The address before the first instruction and after the last one.
pub(crate) const OUTSIDE: u32 = u32::MAX;

impl Transitions {
    /// Takes a trace in.
    pub(crate) fn add(&mut self, path: &[u32]) {
        let mut counts: BTreeMap<(u32, u32), u32> = BTreeMap::new();
        for pair in whole(path).windows(2) {
            *counts.entry((pair[0], pair[1])).or_default() += 1;
        }
        for (pair, count) in counts {
            let most = self.most.entry(pair).or_default();
            *most = count.max(*most);
        }
    }

    /// The largest sum of costs over all paths from outside to outside whose instructions are left as often as they are entered,
    /// and that take no transition more often than a trace did.
    ///
    /// # Errors
    /// A problem that cannot be solved: never, because every trace solves it.
    pub(crate) fn longest(&self, cost: impl Fn(u32, u32) -> u32) -> Result<f64> {
        let mut problem = Problem::new(OptimizationDirection::Maximize);
        let mut balances: BTreeMap<u32, Vec<_>> = BTreeMap::new();
        for (straight, most) in self.straight_runs() {
            let run_cost: u32 = straight.windows(2).map(|pair| cost(pair[0], pair[1])).sum();
            let variable = problem.add_var(f64::from(run_cost), (0.0, f64::from(most)));
            let (first, last) = (straight[0], straight[straight.len() - 1]);
            // One that ends where it begins enters as often as it leaves.
            if first != last {
                balances.entry(first).or_default().push((variable, -1.0));
                balances.entry(last).or_default().push((variable, 1.0));
            }
        }
        for (address, balance) in balances {
            if address != OUTSIDE {
                problem.add_constraint(balance, ComparisonOp::Eq, 0.0);
            }
        }
        match problem.solve() {
            Ok(SolveOutcome::Solution(solution)) => Ok(solution.objective()),
            Ok(SolveOutcome::Interrupted(_)) => {
                bail!("the longest path: the solver has stopped early")
            }
            Err(error) => bail!("the longest path: {error}"),
        }
    }

    /// The transitions, those that can only follow each other joined to runs of addresses.
    fn straight_runs(&self) -> Vec<(Vec<u32>, u32)> {
        let mut next: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        let mut before: BTreeMap<u32, u32> = BTreeMap::new();
        for &(from, to) in self.most.keys() {
            next.entry(from).or_default().push(to);
            *before.entry(to).or_default() += 1;
        }
        let only_passes =
            |address: u32| address != OUTSIDE && next[&address].len() == 1 && before[&address] == 1;
        let mut runs = Vec::new();
        for (&(from, to), &most) in &self.most {
            if only_passes(from) {
                continue;
            }
            let mut run = vec![from, to];
            let mut end = to;
            while only_passes(end) {
                end = next[&end][0];
                run.push(end);
            }
            runs.push((run, most));
        }
        runs
    }
}

/// A path from outside to outside.
pub(crate) fn whole(path: &[u32]) -> Vec<u32> {
    let mut whole = vec![OUTSIDE];
    whole.extend(path);
    whole.push(OUTSIDE);
    whole
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An instruction costs its address.
    fn longest(paths: &[&[u32]]) -> f64 {
        let mut transitions = Transitions::default();
        for path in paths {
            transitions.add(path);
        }
        let cost = |from: u32, _| if from == OUTSIDE { 0 } else { from };
        transitions.longest(cost).unwrap()
    }

    #[test]
    fn of_one_trace_it_is_the_trace() {
        assert_eq!(longest(&[&[1, 2, 3, 2, 3, 4]]), 15.0);
    }

    #[test]
    fn branches_that_no_trace_takes_together_are_taken_together_and_either_or_stays() {
        // 1, then 10 or 11, then 2, then 20 or 21, then 3.
        let paths: [&[u32]; 2] = [&[1, 10, 2, 21, 3], &[1, 11, 2, 20, 3]];
        assert_eq!(longest(&paths), 1.0 + 11.0 + 2.0 + 21.0 + 3.0);
    }

    #[test]
    fn a_loop_is_taken_as_often_as_the_trace_that_took_it_most() {
        let paths: [&[u32]; 2] = [&[1, 5, 5, 5, 2], &[1, 5, 7, 2]];
        // Into the loop once, around it twice, out by way of 7.
        assert_eq!(longest(&paths), 1.0 + 3.0 * 5.0 + 7.0 + 2.0);
    }
}
