//! The motions that results are judged on.

use std::fmt;

use quadrant_sim::sine_test::SineTest;
use quadrant_tune::commission::verify::{Cycles, Moves, run_cycles, run_moves};
use quadrant_tune::test_axis::{ExperimentError, SimulatedTestAxis, approach};

/// A motion that results are judged on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Motion {
    Sine(SineTest, Cycles),
    /// Moves to and fro, with a rest after each.
    Moves(Moves),
}

/// The usual sines, mm and mm/s: none of them is a trial of the commissioning.
const SINES: [(f64, f64); 9] = [
    (4.0, 7.0),
    (0.5, 3.0),
    (10.0, 30.0),
    (1.5, 5.0),
    (2.0, 1.2),
    (0.3, 6.0),
    (7.0, 15.0),
    (12.0, 45.0),
    (0.8, 12.0),
];
/// The usual moves, mm and mm/s.
const MOVES: [(f64, f64); 8] = [
    (0.02, 0.4),
    (0.02, 1.0),
    (0.02, 20.0),
    (0.1, 2.0),
    (0.1, 20.0),
    (0.5, 10.0),
    (2.0, 3.0),
    (8.0, 30.0),
];
/// Share of the travel that a judging sine takes at most.
const MOST_TRAVEL: f64 = 0.4;
/// A few counts.
const FEW_COUNTS: f64 = 5.0;
/// Cycles of a usual sine that are scored.
const USUAL_CYCLES: usize = 4;

impl Motion {
    /// The usual motions.
    pub(super) fn usual() -> Vec<Self> {
        let sine = |&(amplitude_mm, velocity_mm_s): &(f64, f64)| {
            let sine = SineTest {
                amplitude_mm,
                velocity_mm_s,
            };
            Self::Sine(sine, Cycles::scoring(USUAL_CYCLES))
        };
        let moves = |&(distance_mm, velocity_mm_s): &(f64, f64)| {
            Self::Moves(Moves {
                distance_mm,
                velocity_mm_s,
            })
        };
        SINES
            .iter()
            .map(sine)
            .chain(MOVES.iter().map(moves))
            .collect()
    }

    /// A few counts of an encoder, to and fro.
    pub(super) fn of_few_counts(resolution_mm: f64) -> Self {
        Self::Moves(Moves {
            distance_mm: FEW_COUNTS * resolution_mm,
            velocity_mm_s: 1.0,
        })
    }

    /// Runs the law in force on it, within a travel: the largest error, mm.
    pub(super) fn run(
        self,
        axis: &mut SimulatedTestAxis,
        travel_mm: f64,
    ) -> Result<f64, ExperimentError> {
        approach(axis, 0.0)?;
        match self {
            Self::Sine(sine, cycles) => {
                let fitted = sine.within(MOST_TRAVEL * travel_mm);
                run_cycles(axis, "judging", fitted, cycles, &mut |_| {})
                    .map(|(score, _)| score.largest_mm)
            }
            Self::Moves(moves) => {
                let fitted = Moves {
                    distance_mm: moves.distance_mm.min(MOST_TRAVEL * travel_mm),
                    ..moves
                };
                run_moves(axis, "judging", fitted, &mut |_| {})
            }
        }
    }
}

impl fmt::Display for Motion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sine(
                SineTest {
                    amplitude_mm,
                    velocity_mm_s,
                },
                _,
            ) => write!(f, "{amplitude_mm} mm at {velocity_mm_s} mm/s"),
            Self::Moves(Moves {
                distance_mm,
                velocity_mm_s,
            }) => write!(f, "moves of {distance_mm:.4} mm at {velocity_mm_s} mm/s"),
        }
    }
}
