//! The table of what a commissioning will do to an axis.

use quadrant_report::{Cell, Column, Table};
use quadrant_tune::commission::{Planned, stray_mm};
use quadrant_tune::identify::frf::FrfSettings;
use quadrant_tune::test_axis::AxisInfo;

/// The plan for a person, with what keeps the axis within its travel and how accurate the result can be.
pub fn plan_table(info: &AxisInfo, planned: &[Planned]) -> Table {
    let total_s: f64 = planned.iter().map(|step| step.lasts_s).sum();
    let beside = if info.start_mm == 0.0 {
        String::new()
    } else {
        format!(
            " of the middle of its travel, {:.1} mm beside which it stands",
            info.start_mm.abs()
        )
    };
    let band_hz = FrfSettings::default().excitation.band_hz.1;
    let resolved_hz = FrfSettings::default().fitted_to(info).excitation.band_hz.1;
    let coarse = if resolved_hz < band_hz {
        format!(
            ". At {} Hz, resonances above {resolved_hz:.0} Hz are not seen, the loop is slower than it could be, and friction before \
             sliding is resolved in part",
            info.rate_hz
        )
    } else {
        String::new()
    };
    Table {
        id: "plan".to_owned(),
        caption: format!(
            "What the {} axis will do: about {:.0} min of axis time, within {:.1} mm either way{beside}. An experiment ends when \
             the axis is {:.1} mm beside its plan, or too fast to stop in time; it is then repeated more gently, which adds to the \
             time. Positions are known to a count of {} um: errors of two counts are the least that the encoder resolves{coarse}",
            info.name,
            total_s / 60.0,
            info.travel_mm,
            stray_mm(info),
            1e3 * info.resolution_mm,
        ),
        columns: vec![
            Column::new("Step"),
            Column::new("within, mm"),
            Column::new("up to, mm/s"),
            Column::new("Voltage"),
            Column::new("Time, s"),
        ],
        rows: planned
            .iter()
            .map(|step| {
                vec![
                    Cell::text(step.step),
                    Cell::number(step.within_mm, 1),
                    step.fastest_mm_s
                        .map_or(Cell::Missing, |fastest| Cell::number(fastest, 1)),
                    Cell::text(&step.volts),
                    Cell::number(step.lasts_s, 0),
                ]
            })
            .collect(),
    }
}
