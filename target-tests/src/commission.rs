//! `cargo xtask commission`: one axis of the emulated firmware, from an empty flash to settings that beat the PID, through the link alone.

use std::time::Instant;

use anyhow::{Context, Result, ensure};
use quadrant_host::client::Client;
use quadrant_host::machine::{EmulatedLink, Machine};
use quadrant_law::axes::AxisName;
use quadrant_sim::stage_setup::StageSetup;
use quadrant_tune::commission::{CommissionSettings, commission};
use quadrant_tune::identify::static_friction::StaticFrictionSettings;
use quadrant_tune::test_axis::Travel;
use xtask::image::{self, Board, Scalar, Target};
use xtask::toolchain::Toolchain;

/// Control rate, Hz: the emulator takes its time by the tick, and a commissioning takes the axis' time.
const RATE_HZ: f64 = 2_000.0;
/// Travel of the axis either way, mm.
const TRAVEL_MM: f64 = 20.0;
/// Runs at constant velocity: as few, as quick and as short as give a friction model.
const FRICTION: StaticFrictionSettings = StaticFrictionSettings {
    velocities_mm_s: (1.0, 20.0),
    count: 6,
    stretch_mm: 5.0,
    short: None,
    settling_s: 0.3,
    acceleration_mm_s2: 500.0,
};
/// Largest relative error of the acceleration per volt that is found.
const MAX_GAIN_ERROR: f64 = 0.1;
/// Seed of the encoders' noise.
const SEED: u64 = 1;

/// Commissions the x axis of the simulated stage under the image.
///
/// # Errors
/// An emulator that fails, or an axis on which nothing better than the PID is found.
pub(crate) fn run(toolchain: Toolchain) -> Result<()> {
    let image = image::build(toolchain, Target::new(Board::Mps2, Scalar::F32))?;
    let mut setup = StageSetup::simulated();
    setup.settings.rate_hz = RATE_HZ;
    for axis in &mut setup.settings.axes {
        axis.feedback.pid.derivative_filter_s = 1.0 / RATE_HZ;
    }
    let base = setup.settings.axes[0].clone();
    let link = EmulatedLink::start(&image.path, &setup, SEED, None)?;
    let mut client = Client::open(link)?;
    let began = Instant::now();
    let request = CommissionSettings {
        friction: FRICTION,
        ..CommissionSettings::default()
    };
    let mut step = "";
    let mut report = |now, _| {
        if now != step {
            step = now;
            println!("{:>6.1} s  {step}", began.elapsed().as_secs_f64());
        }
    };
    let found = {
        let mut axis = client.test_axis(AxisName::X, Travel::either_way(TRAVEL_MM))?;
        commission(&mut *axis, &base, &request, &mut report)?
    };
    let axis_s: f64 = found.ran.iter().map(|run| run.lasted_s).sum();
    println!(
        "{:.0} s of the axis' time took {:.0} s",
        axis_s,
        began.elapsed().as_secs_f64()
    );
    let true_gain = setup.truth.axes[0].gain_mm_per_v_s2;
    let ratio = found.plant.plant.gain_mm_per_v_s2 / true_gain;
    ensure!(
        (ratio - 1.0).abs() < MAX_GAIN_ERROR,
        "the acceleration per volt that was found is {ratio:.2} of the true one"
    );
    let verification = found.verification.as_ref().context("nothing was tried")?;
    let (worst, mean) = verification.against_pid(verification.chosen());
    println!(
        "{}: {:.0} % of the PID's errors, {:.0} % at worst; acceleration per volt {ratio:.3} of the true one",
        verification.chosen().law,
        100.0 * mean,
        100.0 * worst
    );
    ensure!(
        verification.is_better_than_pid(),
        "nothing was better than the PID alone: {:?}",
        found.notes()
    );
    Ok(())
}
