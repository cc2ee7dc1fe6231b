//! Tuning: what is free in each law within the bounds on robustness.

use quadrant_law::control::feedback::LawKind;
use quadrant_law::control::nctf::NctfGains;
use quadrant_law::control::npid::NonlinearGain;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_law::control::schedule::SchedulePoint;
use quadrant_law::control::sliding_mode::SlidingModeGains;
use quadrant_law::control::surface::SurfaceGains;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_settings::popov::sector_bound;
use quadrant_settings::{AxisSettings, FeedbackSettings};
use quadrant_sim::margins::Margins;
use quadrant_sim::plant::{AxisParameters, Drive, FrictionParameters, Imperfections};
use quadrant_sim::run::RunError;
use quadrant_sim::sine_test::{SineTest, run_sine_tests};
use quadrant_tune::design::{
    DesignError, Form, PidDesign, PidRequest, Process, Target, design_pid,
};
use quadrant_tune::identify::characteristic::Characteristic;
use rayon::prelude::*;

/// Bounds that every law keeps at small errors.
pub const SENSITIVITY_PEAK: f64 = 1.7;
/// See [`SENSITIVITY_PEAK`].
pub const COMPLEMENTARY_PEAK: f64 = 1.3;

/// The sine that knobs are chosen on.
const TRAINING: SineTest = SineTest {
    amplitude_mm: 5.0,
    velocity_mm_s: 10.0,
};
/// Shares of the bounds left to integral action that are tried.
const INTEGRAL_SHARES: [f64; 6] = [0.02, 0.05, 0.08, 0.11, 0.15, 0.2];
/// Share of the Popov bound that the slope of k(e) e takes. The gain alone may take as much by the criterion; but then
/// the loop hunts about a lasting error, and with feedforward, which leaves small ones, all the time.
const SECTOR_SHARE: f64 = 0.75;
/// Ranges emax of the nonlinear gain that are tried, mm; the smallest is four counts of the encoder.
const RANGES_MM: [f64; 6] = [0.002, 0.005, 0.01, 0.02, 0.05, 0.1];
/// Speeds from which a schedule has the gains of motion, mm/s.
const SCHEDULE_SPEEDS_MM_S: [f64; 3] = [0.5, 2.0, 8.0];
/// Switching outputs of sliding mode that are tried, as multiples of the breakaway level.
const SWITCHING: [f64; 5] = [1.1, 1.5, 2.0, 4.0, 10.0];
/// The following-error limit of training, mm: no candidate is judged by a fault.
const FOLLOWING_ERROR_MM: f64 = 20.0;
/// Largest share of a schedule.
const MOST_SHARE: f64 = 30.0;

/// A law as it was tuned.
#[derive(Clone, Debug)]
pub struct TunedLaw {
    pub law: LawKind,
    /// Parameter that was varied, with its unit.
    pub knob: &'static str,
    pub value: f64,
    /// RMS error in training, mm, of every value tried.
    pub tried: Vec<(f64, f64)>,
    pub feedback: FeedbackSettings,
    /// Margins at small errors; of a schedule, at rest.
    pub margins: Margins,
}

/// Reasons for which a law cannot be tuned.
#[derive(Debug, thiserror::Error)]
pub enum TuningError {
    /// The settings have no linear model.
    #[error(
        "the axis has no linear model (plant): identify it first, with `quadrant commission` or `quadrant identify plant`"
    )]
    NoPlant,
    /// The bounds are out of reach.
    #[error(transparent)]
    Design(#[from] DesignError),
    /// The loop cannot be judged.
    #[error("the tuned {law} cannot be judged: {source}")]
    Margins {
        law: &'static str,
        source: quadrant_sim::margins::MarginError,
    },
    /// No candidate is left.
    #[error("no setting of {law} keeps the bounds on this axis")]
    NoCandidate { law: &'static str },
    /// A training run failed.
    #[error(transparent)]
    Run(#[from] RunError),
}

/// A value of a law's knob, and the settings it gives.
type Candidate = (f64, FeedbackSettings);

/// An axis made of what its settings say of it: the twin that laws are trained on.
pub fn twin(axis: &AxisSettings) -> Option<AxisParameters> {
    let plant = axis.plant?;
    Some(AxisParameters {
        gain_mm_per_v_s2: plant.gain_mm_per_v_s2,
        // The friction model's viscous part is all of the damping.
        damping_per_s: 0.0,
        stiffness_per_s2: 0.0,
        delay_s: plant.delay_s,
        friction: axis.friction.sliding,
        gms: axis.friction.gms.clone(),
        model: FrictionParameters::default(),
        drive: Drive::BallScrew,
        resolution_mm: axis.encoder.resolution_mm,
        full_scale_v: axis.amplifier.full_scale_v,
        imperfections: Imperfections::default(),
    })
}

/// Axis and bounds that tuning works with.
struct Bench<'a> {
    axis: &'a AxisSettings,
    twin: AxisParameters,
    plant: PlantModel,
    process: Process,
    form: Form,
    rate_hz: f64,
    seed: u64,
}

/// Tunes every law for an axis. `characteristic` is its measured trajectory, for NCTF. `progress` receives the share that
/// is done, 0 to 1.
///
/// # Errors
/// An axis without a model, bounds out of reach, or a failed run.
pub fn tune_all(
    axis: &AxisSettings,
    characteristic: &Characteristic,
    rate_hz: f64,
    seed: u64,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Vec<TunedLaw>, TuningError> {
    let plant = axis.plant.ok_or(TuningError::NoPlant)?;
    let bench = Bench {
        axis,
        twin: twin(axis).ok_or(TuningError::NoPlant)?,
        plant,
        process: Process::Model(plant),
        form: Form::Sampled {
            sample_time_s: 1.0 / rate_hz,
            computation_delay_s: 0.0,
        },
        rate_hz,
        seed,
    };
    let family: Vec<PidDesign> = INTEGRAL_SHARES
        .par_iter()
        .map(|&share| bench.design(share, None))
        .collect::<Result<_, _>>()?;
    let stiffest = bench.design(0.0, Some(0.0))?;
    progress(0.6);
    let with = |law, base: &PidDesign| FeedbackSettings {
        law,
        integral_limit_v: axis.feedback.integral_limit_v,
        transfer_s: axis.feedback.transfer_s,
        ..FeedbackSettings::all_laws(base.gains, None, axis.limits.max_velocity_mm_s)
    };
    let shares = || INTEGRAL_SHARES.into_iter().zip(&family);
    let integral = "share of the bounds left to the integral";

    let pd = bench.best(
        LawKind::Pd,
        "none",
        vec![(0.0, with(LawKind::Pd, &stiffest))],
    )?;
    let of_family = |law| -> Vec<Candidate> {
        shares()
            .map(|(share, design)| (share, with(law, design)))
            .collect()
    };
    let pid = bench.best(LawKind::Pid, integral, of_family(LawKind::Pid))?;
    let npid = bench.best(LawKind::NPid, "emax (mm)", bench.nonlinear(&pid.feedback))?;
    let scheduled = bench.best(
        LawKind::Scheduled,
        "speed of the second point (mm/s)",
        schedules(&family, &with(LawKind::Scheduled, &family[0])),
    )?;
    let real = |candidate: &Candidate| candidate.1.cascade.is_some();
    let cascades = of_family(LawKind::Cascade)
        .into_iter()
        .filter(real)
        .collect();
    let cascade = bench.best(LawKind::Cascade, integral, cascades)?;
    let sliding = bench.best(
        LawKind::SlidingMode,
        "K (V)",
        bench.switching(&cascade.feedback),
    )?;
    let followed = of_family(LawKind::Nctf)
        .into_iter()
        .filter(real)
        .map(|(share, feedback)| (share, following(feedback, characteristic, axis)))
        .collect();
    let nctf = bench.best(LawKind::Nctf, integral, followed)?;
    progress(1.0);
    Ok(vec![pd, pid, npid, scheduled, cascade, sliding, nctf])
}

/// The measured trajectory in the place of the straight line.
fn following(
    mut feedback: FeedbackSettings,
    characteristic: &Characteristic,
    axis: &AxisSettings,
) -> FeedbackSettings {
    if let Some(gains) = &feedback.nctf {
        let slope = gains.surface().slope_per_s;
        feedback.nctf = Some(NctfGains {
            characteristic: characteristic.points(slope, axis.limits.max_velocity_mm_s),
            ..gains.clone()
        });
    }
    feedback
}

/// Schedules from any design at rest to one that integrates no faster in motion; the same at both is a plain PID.
fn schedules(family: &[PidDesign], base: &FeedbackSettings) -> Vec<Candidate> {
    let shares_of = |speed_mm_s, at: &PidDesign| SchedulePoint {
        speed_mm_s,
        proportional: at.gains.kp_v_per_mm / base.pid.kp_v_per_mm,
        integral: at.gains.ki_v_per_mm_s / base.pid.ki_v_per_mm_s,
        derivative: at.gains.kd_v_s_per_mm / base.pid.kd_v_s_per_mm,
    };
    let pairs = family
        .iter()
        .enumerate()
        .flat_map(|(index, rest)| family[..=index].iter().map(move |moving| (rest, moving)));
    pairs
        .flat_map(|(rest, moving)| SCHEDULE_SPEEDS_MM_S.map(|speed| (speed, rest, moving)))
        .map(|(speed, rest, moving)| [shares_of(0.0, rest), shares_of(speed, moving)])
        .filter(|[rest, moving]| rest.integral.max(moving.integral) <= MOST_SHARE)
        .map(|points| {
            let feedback = FeedbackSettings {
                schedule: Some(points.into_iter().collect()),
                ..base.clone()
            };
            (points[1].speed_mm_s, feedback)
        })
        .collect()
}

/// The nonlinear gain over `range_mm` with the largest slope of k(e) e, above 1.
fn steepest(slope: f64, range_mm: f64) -> NonlinearGain {
    let of = |x: f64| NonlinearGain {
        rate_per_mm: x / range_mm,
        range_mm,
    };
    // The slope rises with x, and is beyond its square.
    let (mut low, mut high) = (0.0, slope.sqrt());
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if of(middle).largest_slope() > slope {
            high = middle;
        } else {
            low = middle;
        }
    }
    of(low)
}

impl Bench<'_> {
    fn design(&self, integral_share: f64, ki: Option<f64>) -> Result<PidDesign, DesignError> {
        let target = Target::Bandwidth {
            sensitivity_peak: SENSITIVITY_PEAK,
            complementary_peak: COMPLEMENTARY_PEAK,
            integral_share,
        };
        design_pid(
            &self.process,
            &PidRequest {
                target,
                form: self.form,
                derivative_filter_s: self.axis.feedback.pid.derivative_filter_s,
                ki_v_per_mm_s: ki,
            },
        )
    }

    fn nonlinear(&self, pid: &FeedbackSettings) -> Vec<Candidate> {
        let bound = sector_bound(&self.plant, &pid.pid, 1.0 / self.rate_hz);
        let slope = SECTOR_SHARE * bound;
        let with = |range_mm: f64| FeedbackSettings {
            law: LawKind::NPid,
            nonlinear: Some(steepest(slope, range_mm)),
            ..pid.clone()
        };
        let allows_gain = slope > 1.0;
        let ranges = RANGES_MM.into_iter().filter(|_| allows_gain);
        ranges.map(|range_mm| (range_mm, with(range_mm))).collect()
    }

    fn switching(&self, cascade: &FeedbackSettings) -> Vec<Candidate> {
        let Some(surface) = SurfaceGains::from_pid(&cascade.pid) else {
            return Vec::new();
        };
        let sliding = &self.axis.friction.sliding;
        let (one, other) = (&sliding.positive.curve, &sliding.negative.curve);
        let breakaway_v = one.breakaway_v.max(other.breakaway_v);
        let with = |switching_v: f64| FeedbackSettings {
            law: LawKind::SlidingMode,
            sliding_mode: Some(SlidingModeGains {
                slope_per_s: surface.slope_per_s,
                switching_v,
                boundary_mm_s: switching_v / surface.gain_v_s_per_mm,
                integral_per_s: surface.integral_per_s,
            }),
            ..cascade.clone()
        };
        SWITCHING
            .into_iter()
            .map(|factor| factor * breakaway_v)
            .filter(|volts| *volts <= self.axis.amplifier.output_limit_v)
            .map(|volts| (volts, with(volts)))
            .collect()
    }

    /// The candidate with the smallest RMS error on the twin.
    fn best(
        &self,
        law: LawKind,
        knob: &'static str,
        candidates: Vec<Candidate>,
    ) -> Result<TunedLaw, TuningError> {
        let costs: Vec<[f64; 3]> = candidates
            .par_chunks(3)
            .map(|chunk| {
                // A short chunk tries its last candidate again.
                let of = |index: usize| &chunk[index.min(chunk.len() - 1)].1;
                let settings = [0, 1, 2].map(|index| self.training(of(index)));
                let outcomes =
                    run_sine_tests(settings, &self.twin, [TRAINING; 3], self.rate_hz, self.seed)?;
                Ok(outcomes.map(|outcome| outcome.score.rms_mm))
            })
            .collect::<Result<_, RunError>>()?;
        let costs = costs.into_iter().flatten();
        let judged: Vec<(f64, Candidate)> = costs.zip(candidates).collect();
        let tried = judged
            .iter()
            .map(|(cost, (value, _))| (*value, *cost))
            .collect();
        let (_, (value, feedback)) = judged
            .into_iter()
            .min_by(|(one, _), (other, _)| one.total_cmp(other))
            .ok_or(TuningError::NoCandidate { law: law.name() })?;
        let gains = feedback.linear_gains();
        let margins = gains
            .first()
            .ok_or(TuningError::NoCandidate { law: law.name() })
            .and_then(|gains| {
                let judged = self.process.margins(gains, self.form);
                judged.map_err(|source| TuningError::Margins {
                    law: law.name(),
                    source,
                })
            })?;
        Ok(TunedLaw {
            law,
            knob,
            value,
            tried,
            feedback,
            margins,
        })
    }

    fn training(&self, feedback: &FeedbackSettings) -> AxisSettings {
        let mut settings = self.axis.clone();
        settings.feedback = feedback.clone();
        settings.feedforward.kind = FeedforwardKind::None;
        settings.limits.following_error_mm = FOLLOWING_ERROR_MM;
        settings.limits.following_error_max_mm = FOLLOWING_ERROR_MM;
        settings
    }
}
