//! An injection from the host's requests to the axis, by way of server, queues and control.

use quadrant_law::axes::AxisName;
use quadrant_law::units::DacCode;
use quadrant_link::message::{
    AxisName as WireAxis, Body, INJECT_VALUES, InjectRequest, InjectStatus, Reply, Voltages,
};

use crate::preemption::settings;
use quadrant_fault_bench::tasks::Tasks;

/// The converter's words per volt.
const PER_VOLT: f32 = DacCode::FULL_SCALE as f32 / 10.0;

fn inject(tasks: &mut Tasks, request: InjectRequest) -> InjectStatus {
    match tasks.ask(Body::Inject(request)) {
        Ok(Reply::Inject(status)) => status,
        other => panic!("{other:?}"),
    }
}

fn open(tasks: &mut Tasks) -> InjectStatus {
    inject(
        tasks,
        InjectRequest::Open {
            axis: WireAxis::Z,
            open_loop: false,
            with_plan: false,
            limit_v: 2.0,
            travel_mm: 5.0,
            max_velocity_mm_s: 100.0,
        },
    )
}

/// One tick, and the word that is injected in it, if it is not zero.
fn step(tasks: &mut Tasks, injected: &mut Vec<i16>) {
    tasks.step();
    let volts = tasks.upper.borrow().state().axes()[AxisName::Z].injected();
    if volts != 0.0 {
        injected.push((volts * PER_VOLT).round() as i16);
    }
}

/// Sends all words as there is room, and runs until the injection has ended; returns the words that were injected.
fn inject_all(tasks: &mut Tasks, words: &[i16]) -> Vec<i16> {
    let mut injected = Vec::new();
    let mut status = open(tasks);
    for _ in 0..1000 {
        let next = status.next_sequence as usize;
        let count = (words.len() - next)
            .min(INJECT_VALUES)
            .min(status.free.into());
        tasks.send(&[Body::Inject(InjectRequest::Values {
            sequence: status.next_sequence,
            values: Voltages::new(words[next..next + count].iter().copied()),
            last: next + count == words.len(),
        })]);
        for _ in 0..40 {
            step(tasks, &mut injected);
        }
        status = inject(
            tasks,
            InjectRequest::Values {
                sequence: 0,
                values: Voltages::default(),
                last: false,
            },
        );
        if status.ended {
            assert_eq!(status.done as usize, words.len());
            return injected;
        }
    }
    panic!("it has not ended: {status:?}");
}

/// Words of up to 1 V, none of them zero, in an order of their own.
fn words(count: i16, first: i16) -> Vec<i16> {
    (0..count).map(|index| first + 7 * (index % 400)).collect()
}

#[test]
fn every_value_is_put_out_once_in_its_order_and_a_second_injection_has_its_own() {
    let mut tasks = Tasks::new(&settings(), 1);
    tasks.ask(Body::Enable).expect("enables");
    for (count, first) in [(1000, 100), (30, 200), (500, -3000)] {
        let words = words(count, first);
        let mut seen = inject_all(&mut tasks, &words).into_iter();
        // Those that were put out while an answer was waited for were not seen.
        let mut missed = 0;
        for word in &words {
            let mut rest = seen.clone();
            match rest.next() {
                Some(found) if found == *word => seen = rest,
                _ => missed += 1,
            }
        }
        assert_eq!(seen.next(), None, "{count} from {first}");
        assert!(missed < words.len() / 2, "{missed} of {count}");
    }
}

#[test]
fn of_an_injection_that_is_broken_off_nothing_comes_with_the_next() {
    let mut tasks = Tasks::new(&settings(), 1);
    tasks.ask(Body::Enable).expect("enables");
    open(&mut tasks);
    for sequence in [0, INJECT_VALUES as u32] {
        inject(
            &mut tasks,
            InjectRequest::Values {
                sequence,
                values: Voltages::new([3000; INJECT_VALUES].into_iter()),
                last: false,
            },
        );
    }
    inject(&mut tasks, InjectRequest::Close);
    tasks.run(500);
    let seen = inject_all(&mut tasks, &words(300, -2900));
    assert!(!seen.is_empty());
    assert!(!seen.contains(&3000), "{seen:?}");
}

#[test]
fn values_that_were_taken_may_come_again_after_the_last_one() {
    let mut tasks = Tasks::new(&settings(), 1);
    tasks.ask(Body::Enable).expect("enables");
    let opened = open(&mut tasks);
    assert_eq!(
        opened.first_tick, None,
        "nothing has been put out: {opened:?}"
    );
    let values = InjectRequest::Values {
        sequence: 0,
        values: Voltages::new([300; INJECT_VALUES].into_iter()),
        last: true,
    };
    let first = inject(&mut tasks, values.clone());
    // The answer was lost, and the host asks once more.
    let again = inject(&mut tasks, values);
    assert_eq!(again.next_sequence, first.next_sequence);
    tasks.run(200);
    let more = tasks.ask(Body::Inject(InjectRequest::Values {
        sequence: first.next_sequence,
        values: Voltages::new([300; 1].into_iter()),
        last: false,
    }));
    assert!(
        matches!(
            more,
            Err(_) | Ok(Reply::Inject(InjectStatus { ended: true, .. }))
        ),
        "{more:?}"
    );
}
