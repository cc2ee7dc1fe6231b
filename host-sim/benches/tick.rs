//! Cost of one control tick on the host: the law alone, and law and simulated stage together; three axes, N-PID with
//! combined feedforward of four elements; and x alone, as campaigns run it. `cargo bench -p quadrant-sim`; the time per iteration
//! is ns per tick, and 100 us over it the ratio to real time at 10 kHz.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use quadrant_law::command::Command;
use quadrant_law::friction::gms::{FIRMWARE_ELEMENTS, MAX_ELEMENTS};
use quadrant_law::safety::SafetyState;
use quadrant_law::scalar::{Fixed, Scalar};
use quadrant_sim::benchmark_job::circle_and_sine;
use quadrant_sim::law_machine::{LawMachine, Operator, TickInput};
use quadrant_sim::plant::{SimulatedAxis, SimulatedStage, StageParameters};

/// A machine on its stage, moving.
struct Rig<S: Scalar> {
    machine: LawMachine<S, FIRMWARE_ELEMENTS>,
    plant: SimulatedStage,
    operator: Operator,
    tick: u32,
}

impl<S: Scalar> Rig<S> {
    fn moving() -> Self {
        let job = circle_and_sine(0.5);
        let mut rig = Self {
            machine: LawMachine::new(&job).expect("the default settings are valid"),
            plant: SimulatedStage::new(&StageParameters::real(), job.stage.rate_hz, 1),
            operator: Operator::runs_the_plan(),
            tick: 0,
        };
        for _ in 0..20_000 {
            rig.step();
        }
        assert_eq!(rig.machine.state().safety(), SafetyState::Enabled);
        assert!(rig.machine.state().is_running());
        rig
    }

    fn step(&mut self) {
        let input =
            TickInput::of_counts(self.plant.read_counters(), self.operator.request(self.tick));
        let outputs = self.machine.tick(&input);
        self.plant.step(&outputs);
        self.tick += 1;
    }
}

fn law<S: Scalar>(criterion: &mut Criterion, name: &str) {
    let mut rig = Rig::<S>::moving();
    let counts = rig.plant.read_counters();
    let still = TickInput::of_counts(counts, None);
    let mut group = criterion.benchmark_group("law");
    group.throughput(Throughput::Elements(100));
    // The counts stand while the reference moves on, so the error is large; no branch of the law is cheaper for it,
    // and the machine is renewed before the following error becomes a fault.
    group.bench_function(name, |bencher| {
        bencher.iter_batched_ref(
            || rig.machine.clone(),
            |machine| {
                for _ in 0..100 {
                    black_box(machine.tick(black_box(&still)));
                }
            },
            criterion::BatchSize::SmallInput,
        );
    });
    group.finish();
}

/// x alone, as campaigns run it, moving.
struct OneAxis {
    machine: LawMachine<f32, MAX_ELEMENTS>,
    plant: SimulatedAxis,
}

impl OneAxis {
    fn moving() -> Self {
        let job = circle_and_sine(0.5);
        let machine = LawMachine::new(&job).expect("the default settings are valid");
        let truth = StageParameters::real().axes[0].clone();
        let mut axis = Self {
            machine: machine.with_x_alone(),
            plant: SimulatedAxis::new(truth, job.stage.rate_hz, 1),
        };
        let mut operator = Operator::runs_the_plan();
        for tick in 0..20_000 {
            axis.step(operator.request(tick));
        }
        assert!(axis.machine.state().is_running());
        axis
    }

    fn step(&mut self, request: Option<Command>) {
        let input = TickInput::of_counts([self.plant.read_counter(), 0, 0], request);
        let outputs = self.machine.tick(&input);
        self.plant.step(outputs.codes[0], outputs.enabled);
    }
}

fn benches(criterion: &mut Criterion) {
    law::<f32>(criterion, "100 ticks, f32");
    law::<f64>(criterion, "100 ticks, f64");
    law::<Fixed>(criterion, "100 ticks, fixed");
    let mut group = criterion.benchmark_group("simulation");
    group.throughput(Throughput::Elements(1));
    let mut rig = Rig::<f32>::moving();
    group.bench_function("tick of law and stage, f32", |bencher| {
        bencher.iter(|| rig.step())
    });
    let mut axis = OneAxis::moving();
    group.bench_function("tick of law and stage, one axis, f32", |bencher| {
        bencher.iter(|| axis.step(None))
    });
    group.finish();
}

criterion_group!(tick, benches);
criterion_main!(tick);
