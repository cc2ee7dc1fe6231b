//! From the measurements of a commissioning to its models and settings: without an axis.

use heapless::Vec as ShortVec;
use quadrant_law::axis::MAX_PREVIEW_TICKS;
use quadrant_law::control::filter::FilterSettings;
use quadrant_law::control::npid::NonlinearGain;
use quadrant_law::control::pid::PidGains;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_law::feedforward::{FeedforwardGains, FeedforwardKind};
use quadrant_law::friction::gms::{FIRMWARE_ELEMENTS, GmsElement, GmsParameters};
use quadrant_law::friction::stribeck::StaticFriction;
use quadrant_law::friction::{FrictionSettings, PerDirection};
use quadrant_settings::leaves::LEAST_STIFFNESS_V_PER_MM;
use quadrant_settings::popov::filtered_sector_bound;
use quadrant_settings::{AxisSettings, FeedbackSettings};

use super::bootstrap::rough_sliding;
use super::commissioned::{ASSUMED_RANGE_MM, CommissionSettings, Commissioned};
use super::error::CommissionError;
use super::ringing::Ringing;
use super::verify::VerifyError;
use crate::design::npid::{NonlinearRule, Range, choose_nonlinear, gain_within_peak};
use crate::design::{
    Form, PidRequest, Process, best_filter_s, best_pid, design_pid, modal_pid, noise_voltage_v,
};
use crate::identify::frf::FrfMeasurement;
use crate::identify::motor_constant::MotorConstant;
use crate::identify::plant::{PlantFit, PlantFitSettings, Stiffness, fit_plant};
use crate::identify::single_state::with_all_models;
use crate::identify::static_friction::{
    Exponent, FrictionFit, FrictionFitError, FrictionMap, KnownViscous, fit_map,
};
use crate::identify::virgin_curve::{
    self, ASSUMED_ATTRACTION_V_S, GmsFit, Knots, VirginCurveError,
};
use crate::record::Recording;
use crate::test_axis::ExperimentError;

/// Pre-sliding range of a stiff axis, mm: before any is identified.
const STIFF_RANGE_MM: f64 = 0.001;
/// Number of elements whose knots are fitted.
const FITTED_KNOTS: usize = 4;
/// Force at which the pre-sliding range ends, over the largest force.
const RANGE_FORCE_SHARE: f64 = 0.95;
/// Last knot over the pre-sliding range.
const LAST_KNOT_RATIO: f64 = 1.7;
/// Exponent of the ladder of knots: above 1 they are denser near zero.
const KNOT_EXPONENT: f64 = 1.6;

/// Measurements of a commissioning.
#[derive(Clone, Debug)]
pub struct Measurements {
    /// Motor constant, from the open-loop test.
    pub motor: MotorConstant,
    /// Response of the sliding axis.
    pub response: FrfMeasurement,
    /// Voltages at constant velocities.
    pub map: FrictionMap,
    /// Recordings of its runs, as far as they are there.
    pub runs: Vec<Recording>,
    /// Recording of the slow sine.
    pub presliding: Recording,
}

/// Models of the axis, and its PID.
pub(super) struct Models {
    pub(super) plant: PlantFit,
    pub(super) controller: Controller,
    pub(super) friction: FrictionFit,
    pub(super) gms: Result<GmsFit, VirginCurveError>,
}

/// PID and filters.
#[derive(Clone, Debug)]
pub(super) struct Controller {
    pub(super) pid: PidGains,
    pub(super) filters: Vec<FilterSettings>,
    /// Largest gain in front of the PID that is shown to be stable with the modes; infinite without any.
    circle_bound: f64,
    /// The changes that what was seen of the axis made to it, a sentence each.
    remarks: Vec<String>,
}

impl Controller {
    /// Takes gains and filters into settings.
    pub(super) fn put_into(&self, settings: &mut AxisSettings) {
        settings.feedback.pid = self.pid;
        settings.feedback.filters =
            (!self.filters.is_empty()).then(|| self.filters.iter().copied().collect());
    }

    /// Takes a softer PID, and no nonlinear gain: the model lacks something.
    pub(super) fn soften(&mut self) {
        self.pid = softer(&self.pid);
        self.circle_bound = 1.0;
    }

    /// Remarks that it was softened because of what stopped the axis while its friction was measured.
    pub(super) fn note_stop(&mut self, error: &ExperimentError) {
        self.remarks.push(format!(
            "While friction was measured, {error}: {}",
            softer_remark(1)
        ));
    }

    /// Remarks how often it was softened because of an oscillation while friction held the axis.
    pub(super) fn note_softening(&mut self, seen: &Ringing, softenings: i32) {
        self.remarks.push(format!(
            "While friction held the axis, the PID oscillated at {:.0} Hz ({:.1} um): {}",
            seen.frequency_hz,
            1e3 * seen.amplitude_mm,
            softer_remark(softenings),
        ));
    }
}

/// Axis and filters as a design sees them.
pub(super) fn process(plant: &PlantFit, filters: &[FilterSettings]) -> Process {
    if plant.modes.is_empty() && filters.is_empty() {
        return Process::Model(plant.plant);
    }
    Process::Modelled {
        plant: plant.plant,
        modes: plant.modes.clone(),
        filters: filters.to_vec(),
    }
}

/// Fits the linear model to the response, and designs the PID on it. `determined`: [`PlantFitSettings::determined`].
pub(super) fn designed(
    response: &FrfMeasurement,
    determined: bool,
    (base, request): (&AxisSettings, &CommissionSettings),
    motor: &MotorConstant,
    rate_hz: f64,
) -> Result<(PlantFit, Controller), CommissionError> {
    let plant = fit_plant(
        &response.estimate.response,
        &PlantFitSettings {
            stiffness: Stiffness::Zero,
            negligible_damping: true,
            determined,
            ..PlantFitSettings::default()
        },
    )?;
    let controller = controller(&plant, base, request, motor, rate_hz)?;
    Ok((plant, controller))
}

/// Designs the PID, and filters where modes want them, on the linear model; with so slow a filter of the derivative that the encoder's
/// noise, as the motor-constant test shows it at rest, does not shake the axis out of its friction.
fn controller(
    plant: &PlantFit,
    base: &AxisSettings,
    request: &CommissionSettings,
    motor: &MotorConstant,
    rate_hz: f64,
) -> Result<Controller, CommissionError> {
    let alone = |pid| Controller {
        pid,
        filters: Vec::new(),
        circle_bound: f64::INFINITY,
        remarks: Vec::new(),
    };
    let pid_filter_s = base.feedback.pid.derivative_filter_s;
    let filter_s = pid_filter_s.min(best_filter_s(rate_hz));
    let Some(target) = request.target else {
        let form = sampled(rate_hz);
        let best = |filter_s: f64| -> Result<Controller, CommissionError> {
            if plant.modes.is_empty() {
                let process = Process::Model(plant.plant);
                return Ok(alone(best_pid(&process, form, filter_s)?.gains));
            }
            let found = modal_pid(&plant.plant, &plant.modes, form, filter_s)?;
            Ok(Controller {
                filters: found.filters,
                circle_bound: found.circle_bound,
                ..alone(found.gains)
            })
        };
        let noise_mm = motor.noise_mm();
        let friction_v = 0.5 * (motor.directed_v[0] + motor.directed_v[1]);
        let mut found = best(filter_s)?;
        for step in 1..=MAX_FILTER_STEPS {
            let axis = process(plant, &found.filters);
            let noise_v = noise_voltage_v(&axis, &found.pid, form, noise_mm);
            if noise_v <= MAX_NOISE_SHARE * friction_v {
                break;
            }
            match best(FILTER_RATIO.powi(step) * filter_s) {
                Ok(quieter) => {
                    found = quieter;
                    found.remarks = vec![format!(
                        "The encoder's noise of {:.2} um RMS would have shaken the axis out of its friction of {friction_v:.3} V: the \
                         derivative is filtered over {:.2} ms.",
                        1e3 * noise_mm,
                        1e3 * found.pid.derivative_filter_s,
                    )];
                }
                // So slow a filter leaves no loop.
                Err(_) => break,
            }
        }
        return Ok(found);
    };
    let design = PidRequest {
        target,
        form: Form::Continuous,
        derivative_filter_s: pid_filter_s,
        ki_v_per_mm_s: None,
    };
    Ok(alone(design_pid(&process(plant, &[]), &design)?.gains))
}

/// RMS voltage that the encoder's noise makes in the loop, over friction, from which on the derivative is filtered more.
const MAX_NOISE_SHARE: f64 = 0.5;
/// Factor on the filter's time constant for each further try.
const FILTER_RATIO: f64 = std::f64::consts::SQRT_2;
/// Largest number of these tries.
const MAX_FILTER_STEPS: i32 = 10;

/// The loop as it runs.
pub(super) fn sampled(rate_hz: f64) -> Form {
    Form::Sampled {
        sample_time_s: 1.0 / rate_hz,
        computation_delay_s: 0.0,
    }
}

/// Relative error of the linear model's damping as a viscous friction: at one velocity part of it is the Stribeck curve.
const VISCOUS_ERROR: f64 = 0.3;

/// The viscous friction that the linear model knows, if it knows one.
pub(super) fn viscous(plant: &PlantFit) -> Option<KnownViscous> {
    let PlantModel {
        gain_mm_per_v_s2,
        damping_per_s,
        ..
    } = plant.plant;
    let deviation = (VISCOUS_ERROR * damping_per_s).hypot(plant.damping_error_per_s());
    let known = KnownViscous {
        value: damping_per_s / gain_mm_per_v_s2,
        deviation: deviation / gain_mm_per_v_s2,
    };
    (damping_per_s > 0.0 && deviation.is_finite()).then_some(known)
}

/// Fits the static friction model to the runs of the map that moved evenly, and to what else is known.
pub(super) fn even_friction(
    map: &FrictionMap,
    viscous: Option<KnownViscous>,
) -> Result<FrictionFit, FrictionFitError> {
    fit_map(map, Exponent::Fixed(1.0), viscous)
}

/// Fits the static friction model to the map. Where too few runs moved evenly the mean voltages of the others count, too: of an
/// axis that sticks and slips they are what there is, and the trials judge what comes of them.
pub(super) fn friction(
    map: &FrictionMap,
    viscous: Option<KnownViscous>,
) -> Result<FrictionFit, CommissionError> {
    match even_friction(map, viscous) {
        Err(FrictionFitError::TooFewRuns { .. }) => {
            let mut all = map.clone();
            for run in &mut all.runs {
                run.stick_slip = false;
            }
            Ok(even_friction(&all, viscous)?)
        }
        found => Ok(found?),
    }
}

/// Identifies the GMS model from the slow sine.
///
/// # Errors
/// A recording that gives none.
pub(super) fn presliding(
    recording: &Recording,
    friction: &FrictionFit,
) -> Result<GmsFit, VirginCurveError> {
    identify_elements(recording, &friction.models())
}

/// Breakaway over what moved the axis that is believed while friction is measured: that of an axis that sticks rises while it rests.
const MOST_BREAKAWAY: f64 = 2.0;

/// Friction while it is measured, with the voltages that moved the axis in positive and negative direction: nothing is known of its
/// springs, and what an encoder must show is not more than stiff ones let through.
pub(super) fn rough_friction(
    directed_v: [f64; 2],
    plant: &PlantModel,
    rate_hz: f64,
) -> FrictionSettings {
    let most_v = directed_v.map(|friction_v| MOST_BREAKAWAY * friction_v);
    let sliding = rough_sliding(most_v);
    let spring = one_spring(most_v[0].max(most_v[1]), STIFF_RANGE_MM);
    let gms = resolved(spring, &sliding, plant, rate_hz);
    with_all_models(sliding, gms)
}

/// One spring that stands for a pre-sliding friction which was not identified, and yields at a displacement in mm.
fn one_spring(breakaway_v: f64, range_mm: f64) -> GmsParameters {
    GmsParameters {
        elements: ShortVec::from_iter([GmsElement {
            stiffness_v_per_mm: breakaway_v / range_mm,
            weight: 1.0,
        }]),
        attraction_v_s: ASSUMED_ATTRACTION_V_S,
    }
}

/// Elements that the control rate resolves on the plant: those of a stiffer axis are softer in the same proportion, and friction that
/// would change within one period follows more slowly.
fn resolved(
    mut gms: GmsParameters,
    sliding: &PerDirection<StaticFriction>,
    plant: &PlantModel,
    rate_hz: f64,
) -> GmsParameters {
    let most_v_per_mm = plant.stiffest_v_per_mm(1.0 / rate_hz);
    let share = (RESOLUTION_SHARE * most_v_per_mm / gms.stiffness_v_per_mm()).min(1.0);
    for element in &mut gms.elements {
        element.stiffness_v_per_mm =
            (share * element.stiffness_v_per_mm).max(LEAST_STIFFNESS_V_PER_MM);
    }
    let lowest_v = [&sliding.positive, &sliding.negative]
        .map(|model| model.curve.coulomb_v.min(model.curve.breakaway_v))
        .into_iter()
        .fold(f64::INFINITY, f64::min);
    gms.attraction_v_s = gms
        .attraction_v_s
        .min(RESOLUTION_SHARE * lowest_v * rate_hz);
    gms
}

/// Remark on a linear model that only describes the response, for a person.
const UNDETERMINED: &str = "The response does not determine the linear model: it describes the axis well enough for a PID, but its A may be \
                            wrong several times over, and fault 28 may come where the axis is struck. Look for play in the drive, and for a \
                            soft spring between motor and table.";
/// Share of the identified stiffness that the control rate resolves, below which that is worth a note.
const NOTED_STIFFNESS_SHARE: f64 = 0.8;
/// Share of the largest value that the law resolves: just below 1, so that rounding loses none of it.
const RESOLUTION_SHARE: f64 = 0.999;

impl Measurements {
    /// Identifies all models and makes the settings, as a commissioning does that measured this; without a verdict.
    ///
    /// # Errors
    /// The first step that fails, with the reason.
    pub fn commissioned(
        self,
        base: &AxisSettings,
        request: &CommissionSettings,
        rate_hz: f64,
    ) -> Result<Commissioned, CommissionError> {
        let design = |determined| {
            let wishes = (base, request);
            designed(&self.response, determined, wishes, &self.motor, rate_hz)
        };
        let (plant, controller) = design(true).or_else(|error| design(false).map_err(|_| error))?;
        let friction = friction(&self.map, viscous(&plant))?;
        let gms = presliding(&self.presliding, &friction);
        let models = Models {
            plant,
            controller,
            friction,
            gms,
        };
        Ok(models.commissioned(self, base, request, rate_hz))
    }
}

impl Models {
    /// Makes the settings, N-PID and combined feedforward included; the verdict is still to come.
    pub(super) fn commissioned(
        self,
        measurements: Measurements,
        base: &AxisSettings,
        request: &CommissionSettings,
        rate_hz: f64,
    ) -> Commissioned {
        let Self {
            plant,
            controller,
            friction,
            gms,
        } = self;
        let Controller { pid, filters, .. } = &controller;
        let (_, breakaway_v) = friction.mean_levels_v();
        // The rigid model's bound is what the firmware checks; with modes the circle criterion must hold, too.
        let bound = filtered_sector_bound(&plant.plant, pid, filters, 1.0 / rate_hz)
            .min(controller.circle_bound);
        let largest = gain_within_peak(
            &process(&plant, filters),
            pid,
            sampled(rate_hz),
            request.nonlinear_peak,
            bound,
        );
        let nonlinear = choose_nonlinear(
            pid,
            bound,
            &NonlinearRule {
                sector_share: request.sector_share,
                largest,
                range: Range::Breakaway(breakaway_v),
            },
        );
        let mut settings = base.clone();
        settings.commissioned = true;
        settings.plant = Some(plant.plant);
        settings.feedback = feedback(base, *pid, nonlinear);
        controller.put_into(&mut settings);
        let elements = gms.as_ref().map_or_else(
            |_| one_spring(breakaway_v, ASSUMED_RANGE_MM),
            |found| found.gms.clone(),
        );
        let sliding = friction.models();
        let identified_v_per_mm = elements.stiffness_v_per_mm();
        let elements = resolved(elements, &sliding, &plant.plant, rate_hz);
        let resolved_v_per_mm = elements.stiffness_v_per_mm();
        let mut remarks = controller.remarks.clone();
        if !plant.is_determined() {
            remarks.push(UNDETERMINED.to_owned());
        }
        if gms.is_ok() && resolved_v_per_mm < NOTED_STIFFNESS_SHARE * identified_v_per_mm {
            remarks.push(format!(
                "Before it slides, the axis is as stiff as {identified_v_per_mm:.1} V/mm, and {rate_hz} Hz resolves \
                 {resolved_v_per_mm:.1}: friction is fed forward as of a softer axis. A higher control rate would do better.",
            ));
        }
        settings.friction = with_all_models(sliding, elements);
        settings.feedforward.kind = FeedforwardKind::Combined;
        settings.feedforward.gains = FeedforwardGains {
            level: 1.0,
            viscous: 1.0,
            presliding: 1.0,
            inertia_v_s2_per_mm: 1.0 / plant.plant.gain_mm_per_v_s2,
        };
        let longest_s = MAX_PREVIEW_TICKS as f64 / rate_hz;
        settings.feedforward.preview_s = plant.plant.delay_s.min(longest_s);
        let margins = process(&plant, filters).margins(pid, sampled(rate_hz));
        Commissioned {
            motor: measurements.motor,
            response: measurements.response,
            plant,
            margins,
            friction: (measurements.map, friction, measurements.runs),
            presliding: (gms, measurements.presliding),
            sector_bound: bound,
            settings,
            remarks,
            ran: Vec::new(),
            hums: None,
            verification: None,
        }
    }
}

/// Every law around a PID, with what of the feedback is the base's.
fn feedback(
    base: &AxisSettings,
    pid: PidGains,
    nonlinear: Option<NonlinearGain>,
) -> FeedbackSettings {
    FeedbackSettings {
        integral_limit_v: base.feedback.integral_limit_v,
        transfer_s: base.feedback.transfer_s,
        ..FeedbackSettings::all_laws(pid, nonlinear, base.limits.max_velocity_mm_s)
    }
}

/// Crossover of a softer PID over that of the PID before it.
const SOFTENING_RATIO: f64 = 0.75;
/// Largest number of softer PIDs, where the designed one oscillates on the axis, or does not hold it.
pub(super) const MAX_SOFTENINGS: i32 = 6;

/// A PID of the same shape at a lower crossover.
fn softer(pid: &PidGains) -> PidGains {
    PidGains {
        kp_v_per_mm: SOFTENING_RATIO.powi(2) * pid.kp_v_per_mm,
        ki_v_per_mm_s: SOFTENING_RATIO.powi(3) * pid.ki_v_per_mm_s,
        kd_v_s_per_mm: SOFTENING_RATIO * pid.kd_v_s_per_mm,
        ..*pid
    }
}

/// What took the place of a PID that was softened, for a person.
fn softer_remark(softenings: i32) -> String {
    format!(
        "a softer one took its place, with {:.0} % of its crossover and without a nonlinear gain.",
        100.0 * SOFTENING_RATIO.powi(softenings)
    )
}

impl Commissioned {
    /// Replaces the law by a PID of the same shape at a lower crossover, for an axis on which it oscillates: the model lacks something,
    /// so there is no nonlinear gain either.
    pub(super) fn soften(&mut self, seen: &VerifyError, rate_hz: f64) {
        self.remarks.push(format!("{seen}: {}", softer_remark(1)));
        let pid = softer(&self.settings.feedback.pid);
        let filters = self.settings.feedback.filters.take();
        self.settings.feedback = FeedbackSettings {
            filters,
            ..feedback(&self.settings, pid, None)
        };
        let filters = self.settings.feedback.filters.as_deref();
        self.margins =
            process(&self.plant, filters.unwrap_or_default()).margins(&pid, sampled(rate_hz));
    }
}

/// The GMS model on as many elements as the firmware has room for, if that predicts the record better than few do.
///
/// Few elements find their own knots. For many the record is too noisy: knots wander off beyond it, and the search may not
/// end. Theirs are spread over the pre-sliding range, denser near zero, where the curve bends most; only shares are searched.
fn identify_elements(
    recording: &Recording,
    sliding: &PerDirection<StaticFriction>,
) -> Result<GmsFit, VirginCurveError> {
    let identify = |knots| virgin_curve::identify(recording, Some(sliding), &knots);
    let few = identify(Knots::Automatic(FITTED_KNOTS))?;
    let top_v = few.curve.top_v();
    let rising = few
        .curve
        .points
        .iter()
        .find(|point| point.force_v >= RANGE_FORCE_SHARE * top_v);
    let range_mm = rising.map_or(0.0, |point| point.displacement_mm);
    let knot = |index: usize| {
        let place = index as f64 / FIRMWARE_ELEMENTS as f64;
        LAST_KNOT_RATIO * range_mm * place.powf(KNOT_EXPONENT)
    };
    let many = identify(Knots::At((1..=FIRMWARE_ELEMENTS).map(knot).collect()));
    Ok(match many {
        Ok(many) if many.prediction.relative_error < few.prediction.relative_error => many,
        _ => few,
    })
}

#[cfg(test)]
mod tests {
    use quadrant_settings::StageSettings;

    use super::*;
    use crate::identify::static_friction::FrictionRun;

    #[test]
    fn the_means_of_runs_that_stuck_and_slipped_count_where_there_are_no_others() {
        let velocities = [0.5, 1.0, 2.0, 4.0, 8.0, 16.0];
        let runs = velocities.iter().flat_map(|speed| {
            [1.0, -1.0].map(|sign| FrictionRun {
                velocity_mm_s: sign * speed,
                voltage_v: sign * (0.1 + 0.001 * speed),
                deviation_v: 1e-3,
                stick_slip: true,
            })
        });
        let mut map = FrictionMap {
            runs: runs.collect(),
        };
        map.runs
            .sort_by(|a, b| a.velocity_mm_s.total_cmp(&b.velocity_mm_s));
        assert!(even_friction(&map, None).is_err());
        let (coulomb_v, _) = friction(&map, None).unwrap().mean_levels_v();
        assert!((coulomb_v - 0.1).abs() < 0.01, "{coulomb_v}");
    }

    #[test]
    fn elements_and_attraction_beyond_what_the_control_rate_resolves_are_less_in_proportion() {
        let element = |stiffness_v_per_mm, weight| GmsElement {
            stiffness_v_per_mm,
            weight,
        };
        let gms = |share: f64| GmsParameters {
            elements: ShortVec::from_iter([
                element(300.0 * share, 0.6),
                element(100.0 * share, 0.4),
            ]),
            attraction_v_s: ASSUMED_ATTRACTION_V_S,
        };
        let plant = StageSettings::simulated().axes[0].plant.unwrap();
        let rate_hz = 4000.0;
        let most = plant.stiffest_v_per_mm(1.0 / rate_hz) / gms(1.0).stiffness_v_per_mm();
        let usual = rough_sliding([0.1, 0.12]);
        assert_eq!(
            resolved(gms(0.5 * most), &usual, &plant, rate_hz),
            gms(0.5 * most)
        );
        let softer = resolved(gms(2.0 * most), &usual, &plant, rate_hz);
        let [first, second] = [0, 1].map(|index| softer.elements[index].stiffness_v_per_mm);
        assert!((first / second - 3.0).abs() < 1e-12);
        assert!((0.99..1.0).contains(&(softer.stiffness_v_per_mm() / (most * 400.0))));
        let hardly_any = resolved(
            gms(0.5 * most),
            &rough_sliding([0.1, 0.001]),
            &plant,
            rate_hz,
        );
        assert!(
            (3.9..4.0).contains(&hardly_any.attraction_v_s),
            "{hardly_any:?}"
        );
    }
}
