//! The motions that results are judged on.

use std::fmt;

use quadrant_settings::AxisSettings;
use quadrant_sim::plant::AxisParameters;
use quadrant_sim::sine_test::SineTest;
use quadrant_tune::commission::verify::{Cycles, Moves, run_cycles, run_moves};
use quadrant_tune::test_axis::{ExperimentError, SimulatedTestAxis, TestAxis, approach};

use super::program;
use super::subject::Subject;

/// A motion that results are judged on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Motion {
    Sine(SineTest, Cycles),
    /// Moves to and fro, with a rest after each.
    Moves(Moves),
    /// The program of the axis.
    Program,
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

    /// Runs settings on an axis of a subject with some parameters: the largest error, mm. `seed` decides the noise.
    pub(super) fn run(
        self,
        settings: &AxisSettings,
        parameters: AxisParameters,
        subject: &Subject,
        seed: u64,
    ) -> Result<f64, String> {
        let travel_mm = subject.travel.half_mm();
        let on_an_axis = |run: &dyn Fn(&mut SimulatedTestAxis) -> Result<f64, ExperimentError>| {
            let mut axis =
                SimulatedTestAxis::new(0, parameters.clone(), seed).with_travel_mm(travel_mm);
            axis.apply(settings).map_err(|error| error.to_string())?;
            approach(&mut axis, 0.0)
                .and_then(|()| run(&mut axis))
                .map_err(|error| error.to_string())
        };
        match self {
            Self::Sine(sine, cycles) => on_an_axis(&|axis| {
                let fitted = sine.within(MOST_TRAVEL * travel_mm);
                run_cycles(axis, "judging", fitted, cycles, &mut |_| {})
                    .map(|(score, _)| score.largest_mm)
            }),
            Self::Moves(moves) => on_an_axis(&|axis| {
                let fitted = Moves {
                    distance_mm: moves.distance_mm.min(MOST_TRAVEL * travel_mm),
                    ..moves
                };
                run_moves(axis, "judging", fitted, &mut |_| {})
            }),
            Self::Program => program::largest_mm(settings, parameters, subject, seed),
        }
    }

    /// True of moves, whether the axis knows their end or not.
    pub(super) fn is_moves(self) -> bool {
        matches!(self, Self::Moves(_) | Self::Program)
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
            Self::Program => f.write_str("a program of moves"),
        }
    }
}
