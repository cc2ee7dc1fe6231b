//! Checks of settings: the range of each number, by the table, and what fields must hold together.

mod feedback;
mod friction;
mod motion;

use super::axis::AxisSettings;
use super::error::{Reason, SettingsError};
use super::leaves::rules::{Limit, OF_AN_AXIS, OF_THE_STAGE, Rule};
use super::stage::StageSettings;
use super::tree::number_at;
use quadrant_law::axes::AxisName;
use quadrant_law::control::feedback::LawKind;

/// The axis that a check is about, or the stage.
#[derive(Clone, Copy)]
struct Place {
    axis: Option<AxisName>,
}

impl Place {
    fn refuse(self, field: &'static str, value: f64, reason: Reason) -> Result<(), SettingsError> {
        Err(SettingsError {
            axis: self.axis,
            field,
            value,
            reason,
        })
    }

    #[inline(never)]
    fn within(
        self,
        field: &'static str,
        value: f64,
        least: f64,
        most: f64,
    ) -> Result<(), SettingsError> {
        if !value.is_finite() {
            self.refuse(field, value, Reason::NotFinite)
        } else if value < least || value > most {
            self.refuse(field, value, Reason::OutOfRange { least, most })
        } else {
            Ok(())
        }
    }
}

impl StageSettings {
    /// Checks every field and what they must hold together. `elements` is the room for GMS elements.
    ///
    /// # Errors
    /// The first field that is refused.
    pub fn validate(&self, elements: usize) -> Result<(), SettingsError> {
        let of_stage = Place { axis: None };
        let [x, _, _] = &self.axes;
        for rule in &OF_THE_STAGE {
            of_stage.check_range(rule, x, 0.0, self.number_at(rule.field))?;
        }
        let period_s = 1.0 / self.rate_hz;
        for (name, axis) in AxisName::ALL.into_iter().zip(&self.axes) {
            axis.validate(Place { axis: Some(name) }, period_s, elements)?;
        }
        Ok(())
    }
}

/// Longest travel over the length after which a serial encoder's count comes again.
const MOST_RANGE_SHARE: f64 = 0.9;

/// Settings of a law that no other law reads.
const OF_A_LAW: [(&str, LawKind); 5] = [
    ("feedback.nonlinear", LawKind::NPid),
    ("feedback.schedule", LawKind::Scheduled),
    ("feedback.cascade", LawKind::Cascade),
    ("feedback.sliding_mode", LawKind::SlidingMode),
    ("feedback.nctf", LawKind::Nctf),
];

/// True if a field belongs to a law that is not in force.
fn is_of_other_law(field: &str, law: LawKind) -> bool {
    OF_A_LAW
        .iter()
        .any(|(part, of)| *of != law && field.starts_with(part))
}

impl Place {
    /// Checks a number, if it is there, against its rule.
    fn check_range(
        self,
        rule: &Rule,
        axis: &AxisSettings,
        period_s: f64,
        number: Option<f64>,
    ) -> Result<(), SettingsError> {
        let Some(number) = number else { return Ok(()) };
        let limits = [&rule.least, &rule.most];
        let [least, most] = if is_of_other_law(rule.field, axis.feedback.law) {
            // It does not act, and so bars no change of what does.
            let [least, most] = limits.map(Limit::constant);
            [
                least.unwrap_or(f64::NEG_INFINITY),
                most.unwrap_or(f64::INFINITY),
            ]
        } else {
            limits.map(|limit| limit.value(axis, period_s))
        };
        self.within(rule.field, number, least, most)
    }
}

impl AxisSettings {
    fn validate(&self, at: Place, period_s: f64, elements: usize) -> Result<(), SettingsError> {
        for rule in &OF_AN_AXIS {
            let Some(read) = rule.point else {
                at.check_range(rule, self, period_s, number_at(self, rule.field))?;
                continue;
            };
            let numbers = (0..).map_while(|point| read(self, point));
            for number in numbers {
                at.check_range(rule, self, period_s, Some(number))?;
            }
        }
        self.validate_homing(at)?;
        self.validate_feedback(at, period_s)?;
        self.validate_friction(at, period_s, elements)?;
        self.validate_serial(at)?;
        self.validate_offset(at)
    }

    fn validate_serial(&self, at: Place) -> Result<(), SettingsError> {
        if let (Some(_), Some(counts)) = (&self.encoder.serial, self.encoder.counts_per_index) {
            let reason = Reason::SerialHasNone;
            return at.refuse("encoder.counts_per_index", counts.into(), reason);
        }
        Ok(())
    }

    /// A position from the start is that of a serial encoder, of no other homing, and of one place in the travel alone.
    fn validate_offset(&self, at: Place) -> Result<(), SettingsError> {
        const OFFSET: &str = "encoder.offset_mm";
        let encoder = &self.encoder;
        let Some(offset_mm) = encoder.offset_mm else {
            return Ok(());
        };
        if encoder.serial.is_none() {
            return at.refuse(OFFSET, offset_mm, Reason::NeedsSerial);
        }
        if self.homing.is_some() {
            return at.refuse(OFFSET, offset_mm, Reason::HomedTwice);
        }
        let Some(travel) = self.limits.travel_mm else {
            return Ok(());
        };
        // Some way remains on either side for an axis that is beyond its travel.
        let most =
            MOST_RANGE_SHARE * libm::scalbn(encoder.resolution_mm, encoder.counter_bits.into());
        if travel.positive - travel.negative > most {
            return at.refuse(
                "limits.travel_mm.positive",
                travel.positive,
                Reason::BeyondRange { most },
            );
        }
        Ok(())
    }

    fn validate_homing(&self, at: Place) -> Result<(), SettingsError> {
        let by_index = self.homing.as_ref().is_some_and(|homing| homing.index);
        if by_index && self.encoder.counts_per_index.is_none() {
            return at.refuse("homing.index", 1.0, Reason::IndexUnknown);
        }
        Ok(())
    }
}
