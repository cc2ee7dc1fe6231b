//! Telemetry: every channel shows what the tick computed, and no drop goes uncounted.

use proptest::prelude::*;
use quadrant::app::glitch_monitor::{CircleReading, GlitchReadings};
use quadrant::app::telemetry::{
    Observation, Packer, Sample, Sampler, SamplerState, Selection, SelectionError, read,
};
use quadrant_law::command::Command;
use quadrant_law::scalar::{Fixed, Quantity, Scalar};
use quadrant_link::message::{
    AxisName, AxisSignal, Channel, MAX_CHANNELS, MachineState, StageSignal, TelemetryBlock,
    UnknownChannel, WordKind,
};
use quadrant_settings::StageSettings;

use quadrant_test_support::{Rig, repeatable, sine_on_x};

fn channel(name: &str) -> Channel {
    name.parse().expect("a channel")
}

const GLITCHES: GlitchReadings = GlitchReadings {
    heights_um: [1.5, 2.5, 3.5],
    circle: CircleReading {
        deviation_um: -5.5,
        angle_deg: 182.0,
    },
};

fn seen<S: Scalar>(rig: &Rig<S>) -> Observation<'_, S, 4> {
    Observation {
        stage: &rig.state,
        glitches: &GLITCHES,
        elapsed_cycles: 1234,
        commanded: false,
    }
}

/// A stage in the middle of a motion, every term of its law at work.
fn moving<S: Scalar>() -> Rig<S> {
    let mut rig = Rig::new(&StageSettings::simulated(), &sine_on_x(30.0, 10.0));
    rig.start();
    for _ in 0..300 {
        rig.tick();
    }
    rig
}

#[test]
fn names_and_numbers_lead_back_to_their_channel() {
    assert_eq!(Channel::all().count(), 3 * 23 + 6);
    for known in Channel::all() {
        assert_eq!(known.to_string().parse(), Ok(known));
        assert_eq!(Channel::try_from(u8::from(known)), Ok(known));
    }
    for name in [
        "",
        "x",
        "x.",
        "w.error",
        "x.errors",
        "stage.error",
        "x.state",
        "x.error.p",
    ] {
        assert_eq!(name.parse::<Channel>(), Err(UnknownChannel), "{name}");
    }
}

fn every_channel_shows_its_term<S: Scalar>() {
    let mut rig = moving::<S>();
    // An axis that is pushed makes the error, and all that follows from it, something other than zero.
    rig.inputs.set_counts([3, 2, 1]);
    rig.tick();
    rig.tick();
    for (axis, name) in AxisName::ALL.into_iter().enumerate() {
        let term = *rig.state.axes()[axis].telemetry();
        let volts = |value: S| f64::from(value.to_f32(Quantity::Voltage));
        for (signal, expected) in [
            (AxisSignal::Position, term.measured.0 as f64),
            (AxisSignal::Error, f64::from(term.error_mm())),
            (
                AxisSignal::Velocity,
                f64::from(term.velocity.to_f32(Quantity::Velocity)),
            ),
            (AxisSignal::Proportional, volts(term.feedback.proportional)),
            (AxisSignal::Integral, volts(term.feedback.integral)),
            (AxisSignal::Derivative, volts(term.feedback.derivative)),
            (AxisSignal::Level, volts(term.feedforward.level)),
            (AxisSignal::Viscous, volts(term.feedforward.viscous)),
            (AxisSignal::Presliding, volts(term.feedforward.presliding)),
            (AxisSignal::Inertia, volts(term.feedforward.inertia)),
            (AxisSignal::BumplessOffset, volts(term.bumpless_offset)),
            (AxisSignal::Output, volts(term.output)),
            (AxisSignal::Code, f64::from(term.code.0)),
            (AxisSignal::LimitedBy, f64::from(term.limited_by as u8)),
            (AxisSignal::Glitch, f64::from(GLITCHES.heights_um[axis])),
        ] {
            let shown = Channel::Axis(name, signal);
            let value = shown.value(read(shown, &seen(&rig)));
            assert_eq!(value, expected, "{shown}");
        }
        let reference = Channel::Axis(name, AxisSignal::Reference);
        let counts = reference.value(read(reference, &seen(&rig))) / 256.0;
        assert!((counts - term.reference.0 as f64 / 65536.0).abs() <= 1.0 / 256.0);
    }
    let x = |name: &str| channel(name).value(read(channel(name), &seen(&rig)));
    for name in [
        "x.error",
        "x.velocity",
        "x.p",
        "x.i",
        "x.d",
        "x.output",
        "x.code",
        "x.reference",
    ] {
        assert_ne!(x(name), 0.0, "{name} is at work");
    }
}

#[test]
fn every_channel_of_floats_shows_its_term() {
    every_channel_shows_its_term::<f32>();
}

#[test]
fn every_channel_of_fixed_point_shows_its_term() {
    every_channel_shows_its_term::<Fixed>();
}

#[test]
fn the_velocity_channel_is_the_references_velocity() {
    let mut rig = moving::<f64>();
    let x = |rig: &Rig<f64>| rig.state.axes()[0].telemetry().reference.0 as f64 / 65536.0 * 5e-4;
    // The feedforward's reference is ahead of the one that is shown, by the preview.
    let shown = channel("x.velocity").value(read(channel("x.velocity"), &seen(&rig)));
    let preview = StageSettings::simulated().axes[0].feedforward.preview_s * 1e4;
    for _ in 0..preview.round() as u32 {
        rig.tick();
    }
    let before = x(&rig);
    rig.tick();
    let after = x(&rig);
    let slope = (after - before) * 1e4;
    assert!(
        (slope - shown).abs() < 0.02 * shown.abs(),
        "{slope} for {shown}"
    );
}

#[test]
fn the_stages_channels_show_state_fault_tick_and_time() {
    let mut rig = Rig::<f32>::new(&StageSettings::simulated(), &sine_on_x(30.0, 10.0));
    let word = |rig: &Rig<f32>, signal| read(Channel::Stage(signal), &seen(rig));
    rig.tick();
    assert_eq!(
        word(&rig, StageSignal::State),
        MachineState::Disabled as u32
    );
    assert_eq!(word(&rig, StageSignal::Tick), 0);
    rig.command(Command::Enable);
    assert_eq!(word(&rig, StageSignal::State), MachineState::Enabled as u32);
    assert_eq!(word(&rig, StageSignal::Fault), 0);
    rig.inputs.set_counts([1 << 30, 0, 0]);
    rig.tick();
    assert_eq!(word(&rig, StageSignal::State), MachineState::Fault as u32);
    assert_eq!(word(&rig, StageSignal::Fault), 2);
    assert_eq!(word(&rig, StageSignal::Tick), 2);
    assert_eq!(word(&rig, StageSignal::Elapsed), 1234);
    let value = |name: &str| channel(name).value(read(channel(name), &seen(&rig)));
    assert_eq!(value("stage.circle-deviation"), -5.5);
    assert_eq!(value("stage.circle-angle"), 182.0);
}

#[test]
fn integers_are_exact_and_ticks_count_through_all_bits() {
    assert_eq!(channel("x.code").value(-32768i32 as u32), -32768.0);
    assert_eq!(channel("x.position").value(u32::MAX), -1.0);
    assert_eq!(channel("stage.tick").value(u32::MAX), 4_294_967_295.0);
    assert_eq!(channel("x.p").word_kind(), WordKind::Float);
    assert_eq!(channel("x.reference").word_kind(), WordKind::Integer);
}

#[test]
fn selections_of_none_of_nine_and_of_no_period_are_refused() {
    let channels: Vec<Channel> = Channel::all().take(9).collect();
    assert_eq!(Selection::new(&[], 1), Err(SelectionError::Channels(0)));
    assert_eq!(
        Selection::new(&channels, 1),
        Err(SelectionError::Channels(9))
    );
    assert_eq!(
        Selection::new(&channels[..8], 0),
        Err(SelectionError::Decimation)
    );
    let text = SelectionError::Channels(9).to_string();
    assert!(text.contains('9') && text.contains("1 to 8"), "{text}");
    assert!(Selection::new(&channels[..8], u16::MAX).is_ok());
}

fn samples(
    sampler: &Sampler,
    state: &mut SamplerState,
    rig: &mut Rig<f32>,
    ticks: u32,
) -> Vec<Sample> {
    (0..ticks)
        .filter_map(|_| {
            rig.tick();
            sampler.step(state, &seen(rig))
        })
        .collect()
}

#[test]
fn samples_come_every_decimation_ticks_with_the_channels_in_order() {
    let selection = Selection::new(&[channel("stage.tick"), channel("x.code")], 7).expect("two");
    let sampler = Sampler::new(Some(selection), 1);
    let mut state = SamplerState::default();
    let mut rig = moving::<f32>();
    let taken = samples(&sampler, &mut state, &mut rig, 70);
    assert_eq!(taken.len(), 10);
    for (number, sample) in taken.iter().enumerate() {
        assert_eq!(sample.sequence, number as u32);
        assert_eq!(sample.tick, taken[0].tick + 7 * number as u32);
        assert_eq!(sample.words[0], sample.tick);
        assert_ne!(sample.words[1], 0);
        assert_eq!(sample.words[2..], [0; 6]);
    }
}

#[test]
fn without_a_selection_there_are_no_samples_and_another_one_starts_anew() {
    let mut rig = moving::<f32>();
    let mut state = SamplerState::default();
    let one = |decimation| Selection::new(&[channel("x.error")], decimation).ok();
    assert_eq!(samples(&Sampler::default(), &mut state, &mut rig, 50), []);
    let slow = Sampler::new(one(1000), 1);
    assert_eq!(samples(&slow, &mut state, &mut rig, 50).len(), 1);
    let fast = samples(&Sampler::new(one(1), 2), &mut state, &mut rig, 50);
    assert_eq!(fast.len(), 50, "does not wait for the slow one's period");
    assert!(fast.iter().all(|sample| sample.generation == 2));
    assert_eq!((fast[0].sequence, fast[49].sequence), (0, 49));
}

/// Samples of `channels` words that say which number and channel they are.
fn numbered(sequence: u32, channels: usize) -> Sample {
    let mut words = [0; MAX_CHANNELS];
    for (index, word) in words[..channels].iter_mut().enumerate() {
        *word = sequence << 4 | index as u32;
    }
    Sample {
        sequence,
        tick: 100 + 3 * sequence,
        generation: 1,
        words,
    }
}

proptest! {
    #![proptest_config(repeatable(300))]

    #[test]
    fn blocks_hold_every_sample_that_was_not_dropped_and_count_the_others(
        channels in 1usize..=MAX_CHANNELS,
        kept in prop::collection::vec(prop::bool::weighted(0.9), 1..600),
    ) {
        let all: Vec<Channel> = Channel::all().take(channels).collect();
        let selection = Selection::new(&all, 3).expect("valid");
        let mut packer = Packer::new(&selection, 1);
        let sent: Vec<Sample> = (0..).zip(&kept).filter(|(_, kept)| **kept)
            .map(|(sequence, _)| numbered(sequence, channels)).collect();
        let mut blocks: Vec<TelemetryBlock> = Vec::new();
        for sample in &sent {
            // A sample of a selection that is over changes nothing.
            prop_assert_eq!(packer.push::<f32>(&Sample { generation: 0, ..*sample }), None);
            blocks.extend(packer.push::<f32>(sample));
        }
        blocks.extend(packer.flush());
        prop_assert_eq!(packer.flush(), None);
        let mut arrived = Vec::new();
        for block in &blocks {
            let words: Vec<u32> = block.words.iter().collect();
            prop_assert_eq!(words.len() % channels, 0);
            prop_assert_eq!(usize::from(block.channels), channels);
            for (k, words) in (0u32..).zip(words.chunks(channels)) {
                let mut sample = Sample {
                    sequence: block.sequence + k,
                    tick: block.tick + k * u32::from(selection.decimation()),
                    generation: block.generation,
                    words: [0; MAX_CHANNELS],
                };
                sample.words[..channels].copy_from_slice(words);
                arrived.push(sample);
            }
            let before = arrived.len() as u32;
            prop_assert_eq!(block.dropped, arrived[before as usize - 1].sequence + 1 - before);
        }
        prop_assert_eq!(&arrived, &sent);
        if let Some(last) = sent.last() {
            prop_assert_eq!(packer.dropped(), last.sequence + 1 - sent.len() as u32);
        }
    }
}

#[test]
fn a_full_block_is_given_without_waiting_for_a_flush() {
    let selection = Selection::new(&[channel("x.error"); 8], 1).expect("eight");
    let mut packer = Packer::new(&selection, 1);
    let blocks: Vec<_> = (0..140)
        .filter_map(|k| packer.push::<f32>(&numbered(k, 8)))
        .collect();
    assert_eq!(
        blocks.len(),
        9,
        "14 samples of 8 channels a block, the tenth still open"
    );
    assert!(blocks.iter().all(|block| block.words.len() == 112));
}
