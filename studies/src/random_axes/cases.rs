//! Named axes unlike the simulated stage's: each with one thing that a commissioning may stumble over.

use quadrant_cli::say;
use quadrant_sim::plant::{AxisParameters, Backlash, Drive, EncoderSide, StageParameters};
use quadrant_tune::test_axis::Travel;

use super::subject::Subject;
use super::{Line, Outcome, Path, judge_subject};
use crate::true_friction::TrueFriction;

/// Damping of the resonances.
const DAMPING: f64 = 0.03;
/// The motor's share of the mass.
const MOTOR_SHARE: f64 = 0.5;
/// Time in which an axis warms, s.
const WARMS_S: f64 = 300.0;
/// Travel of the cases that say nothing of it, mm.
const TRAVEL_MM: f64 = 200.0;

fn x() -> AxisParameters {
    StageParameters::real().axes[0].clone()
}

/// Both levels of friction over those of the simulated stage's x axis, in both directions.
fn with_levels(mut axis: AxisParameters, coulomb: f64, breakaway: f64) -> AxisParameters {
    for way in [&mut axis.friction.positive, &mut axis.friction.negative] {
        way.curve.coulomb_v *= coulomb;
        way.curve.breakaway_v *= breakaway;
    }
    axis
}

fn resonant(frequency_hz: f64, encoder: EncoderSide) -> AxisParameters {
    let mut axis = x();
    axis.drive = Drive::RackAndPinion(Backlash::resonating(
        frequency_hz,
        DAMPING,
        MOTOR_SHARE,
        axis.gain_mm_per_v_s2,
        encoder,
    ));
    axis
}

fn case(description: &str, parameters: AxisParameters) -> Subject {
    Subject {
        seed: 1,
        parameters,
        travel: Travel::either_way(TRAVEL_MM),
        resonance_hz: None,
        warming: (0.0, 1.0),
        description: description.to_owned(),
    }
}

/// The x axis of the simulated stage, changed in one way each.
pub fn cases() -> Vec<Subject> {
    let mut asymmetric = TrueFriction::Lugre.of(x()).with_mass(2.0);
    asymmetric.friction.positive.curve.coulomb_v *= 1.2;
    asymmetric.friction.positive.curve.breakaway_v *= 1.2;
    let mut varying = x();
    varying.imperfections.friction_variation = 0.15;
    varying.imperfections.friction_period_mm = 150.0;
    let mut cases = vec![
        case("half the mass (A x 2)", x().with_mass(0.5)),
        case("LuGre", TrueFriction::Lugre.of(x())),
        case("Dahl", TrueFriction::Dahl.of(x())),
        case("LuGre, 20 % more one way, mass x 2", asymmetric),
    ];
    for frequency_hz in [300.0, 150.0, 30.0] {
        for (side, encoder) in [("table", EncoderSide::Load), ("motor", EncoderSide::Motor)] {
            let name = format!("resonance at {frequency_hz} Hz, encoder on the {side}");
            cases.push(Subject {
                resonance_hz: Some(frequency_hz),
                ..case(&name, resonant(frequency_hz, encoder))
            });
        }
    }
    let warm = |share: f64, name: &str| Subject {
        warming: (share, WARMS_S),
        ..case(name, x())
    };
    let short = |negative_mm: f64, positive_mm: f64, name: &str| Subject {
        travel: Travel {
            negative_mm,
            positive_mm,
        },
        ..case(name, x())
    };
    cases.extend([
        // The breakaway level lies below the Coulomb level.
        case("friction rising with speed", with_levels(x(), 1.2, 0.7)),
        case("friction +-15 % along the travel", varying),
        warm(-0.25, "friction 25 % less when warm"),
        warm(0.25, "friction 25 % more when warm"),
        short(10.0, 10.0, "travel of 10 mm either way"),
        short(3.0, 37.0, "travel of -3 to 37 mm"),
    ]);
    cases
}

/// Commissions and judges the named axes, and prints a table of them, in Markdown.
pub fn print_table() {
    say!("Simulated, not measured\n");
    say!(
        "| axis | result | feedforward | largest error against the PID: mean, worst | axis time |"
    );
    say!("|---|---|---|---|---|");
    for case in cases() {
        say!("{}", row(&judge_subject(&case, Path::Law)));
    }
}

/// A row of the table.
fn row(line: &Line) -> String {
    let percent = |ratio: Option<f64>| {
        ratio.map_or("–".to_owned(), |ratio| {
            format!("{:+.0} %", 100.0 * (ratio - 1.0))
        })
    };
    let errors = match line.outcome {
        Outcome::Refused | Outcome::RefusedWrongly => line.reason.clone(),
        _ => format!(
            "{}, {}",
            percent(line.mean_ratio),
            percent(line.worst_ratio)
        ),
    };
    format!(
        "| {} | {} | {} | {errors} | {:.0} min |",
        line.axis, line.outcome, line.feedforward, line.axis_min
    )
}
