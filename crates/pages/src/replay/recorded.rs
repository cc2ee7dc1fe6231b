//! Our controllers over a recorded reference, beside what the recorded machine did.

use std::fmt;

use heapless::Vec as ShortVec;
use quadrant_law::axes::AxisName;
use quadrant_law::control::feedback::LawKind;
use quadrant_law::control::npid::NonlinearGain;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_law::friction::PerDirection;
use quadrant_law::friction::gms::{GmsElement, GmsParameters};
use quadrant_law::friction::stribeck::{StaticFriction, StribeckCurve};
use quadrant_law::reference::{Motion, MotionScale, RecordedTable};
use quadrant_law::units::Position;
use quadrant_settings::{AxisSettings, StageSettings};
use quadrant_sim::law_machine::LawMachine;
use quadrant_sim::metrics::{largest, rms};
use quadrant_sim::plant::{
    AxisParameters, Drive, FrictionParameters, Imperfections, SimulatedStage, StageParameters,
};
use quadrant_sim::run::{ELEMENTS, RunError, run};
use quadrant_tune::design::set_best_pid;
use quadrant_tune::design::{DesignError, Form, Process, ShapingError, shape_to_margins};
use quadrant_tune::identify::single_state::with_all_models;
use quadrant_tune::record::{AxisLimits, Record};
use rayon::prelude::*;

use crate::experiment::configuration::{Configuration, Gains};
use crate::experiment::run_configuration::RunConfiguration;

/// An axis that can follow a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum RecordedAxis {
    /// The Electro-Mechanical Positioning System, by its published model.
    Emps,
    /// The simulated stage's x axis.
    X,
    /// The simulated stage's y axis.
    Y,
    /// The simulated stage's z axis.
    Z,
}

impl fmt::Display for RecordedAxis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Emps => "EMPS (published model)",
            Self::X => "x of the simulated stage",
            Self::Y => "y of the simulated stage",
            Self::Z => "z of the simulated stage",
        })
    }
}

/// The EMPS axis as published: A. Janot, M. Gautier, M. Brunot, *Data Set and Reference Models of EMPS*, Workshop on
/// Nonlinear System Identification Benchmarks, Eindhoven, 2019 (IDIM-LS).
mod emps {
    /// Moving mass, kg.
    pub(super) const MASS_KG: f64 = 95.1089;
    /// Viscous friction, N s/m.
    pub(super) const VISCOUS_N_S_PER_M: f64 = 203.5034;
    /// Coulomb friction, N.
    pub(super) const COULOMB_N: f64 = 20.3935;
    /// Force per volt at the controller's output, N/V.
    pub(super) const FORCE_N_PER_V: f64 = 35.150_651_882_485_47;
    /// Force offset, N.
    pub(super) const OFFSET_N: f64 = -3.1648;
    /// Resolution of the recorded position, mm.
    pub(super) const RESOLUTION_MM: f64 = 5e-5;
    /// Travel, mm; chosen above the record's 0.25 m.
    pub(super) const TRAVEL_MM: f64 = 400.0;
    /// Dead time, s; chosen: the published model has none, and no gain would then be too high.
    pub(super) const DELAY_S: f64 = 1.0e-3;
    /// Pre-sliding range, mm; chosen: the published model steps from -Fc to Fc at once.
    pub(super) const PRESLIDING_MM: f64 = 0.005;
    /// Rate at which friction follows its curve, V/s; without effect on a constant level.
    pub(super) const ATTRACTION_V_S: f64 = 5.0;
}

/// Gain margin and phase margin of the EMPS axis' PID: the thesis'.
const MARGINS: (f64, f64) = (9.9, 54.2);
/// Integral gain over proportional gain, 1/s: that of the x axis.
const INTEGRAL_RATIO_PER_S: f64 = 0.66;

/// Axis under test: law and plant.
pub struct Axis {
    pub settings: AxisSettings,
    /// The same with the best PID.
    pub best: AxisSettings,
    pub truth: AxisParameters,
}

impl RecordedAxis {
    fn build(self, setup: &RunConfiguration) -> Result<Axis, ReplayError> {
        let simulated = |index: usize| Axis {
            settings: setup.stage.axes[index].clone(),
            best: setup.stage_of(Configuration::BEST_PID).axes[index].clone(),
            truth: setup.truth.axes[index].clone(),
        };
        Ok(match self {
            Self::Emps => emps_axis()?,
            Self::X => simulated(0),
            Self::Y => simulated(1),
            Self::Z => simulated(2),
        })
    }

    /// The axis of a stage; none of the EMPS axis.
    pub const fn name(self) -> Option<AxisName> {
        match self {
            Self::Emps => None,
            Self::X => Some(AxisName::X),
            Self::Y => Some(AxisName::Y),
            Self::Z => Some(AxisName::Z),
        }
    }

    /// Returns the limits that a record for this axis must keep.
    pub fn limits(self) -> AxisLimits {
        let (travel_mm, resolution_mm) = match self {
            Self::Emps => (emps::TRAVEL_MM, emps::RESOLUTION_MM),
            Self::X | Self::Y | Self::Z => (400.0, 5e-4),
        };
        AxisLimits {
            travel_mm,
            max_velocity_mm_s: 250.0,
            max_acceleration_mm_s2: 5000.0,
            resolution_mm,
        }
    }
}

/// Makes the EMPS axis of its published model, with a PID designed on it.
///
/// # Errors
/// No PID has the margins, or keeps the bounds of the best one.
fn emps_axis() -> Result<Axis, ReplayError> {
    let per_newton = 1.0 / emps::FORCE_N_PER_V;
    let gain = emps::FORCE_N_PER_V / emps::MASS_KG * 1e3;
    let friction = PerDirection::both(StaticFriction {
        curve: StribeckCurve {
            coulomb_v: emps::COULOMB_N * per_newton,
            breakaway_v: emps::COULOMB_N * per_newton,
            stribeck_velocity_mm_s: 1.0,
            exponent: 1.0,
        },
        viscous_v_s_per_mm: emps::VISCOUS_N_S_PER_M * per_newton * 1e-3,
    });
    let gms = GmsParameters {
        elements: ShortVec::from_iter([GmsElement {
            stiffness_v_per_mm: emps::COULOMB_N * per_newton / emps::PRESLIDING_MM,
            weight: 1.0,
        }]),
        attraction_v_s: emps::ATTRACTION_V_S,
    };
    let plant = PlantModel {
        gain_mm_per_v_s2: gain,
        damping_per_s: emps::VISCOUS_N_S_PER_M / emps::MASS_KG,
        stiffness_per_s2: 0.0,
        delay_s: emps::DELAY_S,
    };
    let mut settings = quadrant_settings::presets::x_axis();
    let filter_s = settings.feedback.pid.derivative_filter_s;
    let mut pid = shape_to_margins(
        &Process::Model(plant),
        Form::Continuous,
        filter_s,
        MARGINS.0,
        MARGINS.1,
    )?;
    pid.ki_v_per_mm_s = INTEGRAL_RATIO_PER_S * pid.kp_v_per_mm;
    settings.encoder.resolution_mm = emps::RESOLUTION_MM;
    settings.feedback.pid = pid;
    settings.feedback.law = LawKind::NPid;
    settings.feedback.nonlinear = Some(NonlinearGain {
        // The x axis' largest gain, over the errors that this far finer axis has.
        rate_per_mm: 150.0,
        range_mm: 0.01,
    });
    settings.friction = with_all_models(friction, gms.clone());
    settings.feedforward.gains.inertia_v_s2_per_mm = 1.0 / gain;
    settings.feedforward.preview_s = emps::DELAY_S;
    // The published offset is a constant force that the controller must hold.
    settings.amplifier.offset_v = emps::OFFSET_N * per_newton;
    settings.plant = Some(plant);
    settings.limits.max_acceleration_mm_s2 = 5000.0;
    settings.limits.braking_mm_s2 = settings.limits.max_acceleration_mm_s2;
    let truth = AxisParameters {
        gain_mm_per_v_s2: gain,
        // All viscous friction is in the friction model, as published.
        damping_per_s: 0.0,
        stiffness_per_s2: 0.0,
        delay_s: emps::DELAY_S,
        friction,
        gms,
        model: FrictionParameters::Gms,
        resolution_mm: emps::RESOLUTION_MM,
        full_scale_v: 10.0,
        imperfections: Imperfections {
            offset_v: -emps::OFFSET_N * per_newton,
            ..Imperfections::default()
        },
        drive: Drive::BallScrew,
        velocity_drive: None,
    };
    let mut best = settings.clone();
    set_best_pid(&mut best, StageSettings::simulated().rate_hz)?;
    Ok(Axis {
        settings,
        best,
        truth,
    })
}

/// Time from the start of the record that is not scored, s: a record may begin in the middle of a motion.
pub const SETTLING_S: f64 = 0.5;

/// The part of an error that is scored.
fn settled(mut error_mm: Vec<f64>, period_s: f64) -> Vec<f64> {
    error_mm.drain(..error_mm.len().min((SETTLING_S / period_s).round() as usize));
    error_mm
}

/// Result of one configuration on the record.
#[derive(Clone, Debug)]
pub struct RecordedOutcome {
    /// Configuration; `None` for the recorded machine itself.
    pub configuration: Option<Configuration>,
    /// Largest |e|, mm.
    pub largest_mm: f64,
    /// RMS of e, mm.
    pub rms_mm: f64,
    /// The error over the scored part of the record, mm, a sample a `period_s`.
    pub error_mm: Vec<f64>,
    /// Time between samples of the error, s.
    pub period_s: f64,
}

/// Reasons for which a record cannot be replayed.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    #[error(transparent)]
    Run(#[from] RunError),
    /// No PID has the margins.
    #[error("no PID for the axis: {0}")]
    Design(#[from] ShapingError),
    /// No PID keeps the bounds of the best one.
    #[error("no best PID for the axis: {0}")]
    Best(#[from] DesignError),
    /// The record's sample time is no multiple of the control period.
    #[error(
        "the record's sample time, {sample_time_s} s, is not a whole number of control periods of {period_s} s; \
         resample the record to a multiple of the control period"
    )]
    SampleTime { sample_time_s: f64, period_s: f64 },
}

impl From<quadrant_settings::SettingsError> for ReplayError {
    fn from(error: quadrant_settings::SettingsError) -> Self {
        Self::Run(RunError::Settings(error))
    }
}

/// Makes the motion along recorded positions, mm. Its table stays in flash in a firmware; here it lives as long as the
/// process.
///
/// # Errors
/// A sample time that is not a whole number of control periods.
pub fn recorded_motion(
    positions_mm: &[f64],
    sample_time_s: f64,
    scale: MotionScale,
) -> Result<RecordedTable<f32>, ReplayError> {
    let ticks = sample_time_s * scale.rate_hz;
    let ticks_per_sample = ticks.round();
    if ticks_per_sample < 1.0 || (ticks - ticks_per_sample).abs() > 1e-3 * ticks_per_sample {
        return Err(ReplayError::SampleTime {
            sample_time_s,
            period_s: 1.0 / scale.rate_hz,
        });
    }
    let positions: Vec<Position> = positions_mm
        .iter()
        .map(|&mm| Position::from_mm(mm, scale.resolution_mm))
        .collect();
    Ok(RecordedTable::new(
        positions.leak(),
        ticks_per_sample as u32,
        scale,
    ))
}

/// Runs all configurations over the record's reference, in parallel, and scores them beside the recorded machine.
/// An axis of the simulated stage is that of `setup`.
///
/// # Errors
/// A record that does not fit the control rate, refused settings, or a fault.
pub fn replay(
    record: &Record,
    axis: RecordedAxis,
    setup: &RunConfiguration,
    seed: u64,
    advance: &(dyn Fn() + Sync),
) -> Result<Vec<RecordedOutcome>, ReplayError> {
    let axis = axis.build(setup)?;
    let rate_hz = StageSettings::simulated().rate_hz;
    let scale = MotionScale {
        resolution_mm: axis.settings.encoder.resolution_mm,
        rate_hz,
    };
    let table = recorded_motion(&record.reference_mm, record.sample_time_s, scale)?;
    let duration_s = record.reference_mm.len() as f64 * record.sample_time_s;
    let most_ticks = (duration_s * rate_hz).round() as usize + 10_000;
    let machine_itself = record.position_mm.as_ref().map(|position| {
        let error_mm: Vec<f64> = record
            .reference_mm
            .iter()
            .zip(position)
            .map(|(reference, position)| reference - position)
            .collect();
        let error_mm = settled(error_mm, record.sample_time_s);
        RecordedOutcome {
            configuration: None,
            largest_mm: largest(&error_mm),
            rms_mm: rms(&error_mm),
            error_mm,
            period_s: record.sample_time_s,
        }
    });
    let ours: Result<Vec<_>, ReplayError> = setup
        .configurations(true)
        .into_par_iter()
        .map(|configuration| {
            let outcome = run_record(configuration, &axis, &table, most_ticks, seed);
            advance();
            outcome
        })
        .collect();
    Ok(machine_itself.into_iter().chain(ours?).collect())
}

fn run_record(
    configuration: Configuration,
    axis: &Axis,
    table: &RecordedTable<f32>,
    most_ticks: usize,
    seed: u64,
) -> Result<RecordedOutcome, ReplayError> {
    let mut settings = StageSettings::simulated();
    settings.axes[0] = match configuration.gains {
        Gains::Settings | Gains::Commissioned => axis.settings.clone(),
        Gains::BestPid => axis.best.clone(),
    };
    configuration.apply(&mut settings);
    let mut truth = StageParameters::ideal();
    truth.axes[0] = axis.truth.clone();
    let mut machine = LawMachine::<f32, ELEMENTS>::with_plan(
        settings.build()?,
        [Motion::Recorded(table.clone()), Motion::Hold, Motion::Hold],
    );
    let mut plant = SimulatedStage::new(&truth, settings.rate_hz, seed);
    let resolution_mm = settings
        .axes
        .each_ref()
        .map(|axis| axis.encoder.resolution_mm);
    let [trace, ..] = run(&mut machine, &mut plant, resolution_mm, most_ticks)?;
    let period_s = 1.0 / settings.rate_hz;
    let error_mm = settled(trace.error_mm, period_s);
    Ok(RecordedOutcome {
        configuration: Some(configuration),
        largest_mm: largest(&error_mm),
        rms_mm: rms(&error_mm),
        error_mm,
        period_s,
    })
}
