//! The board's log over the link: pages by number, and what is lost.

use quadrant_fault_bench::tasks::{Tasks, write_log};
use quadrant_link::message::{Body, LogPage, Reply};

use crate::preemption::settings;

fn page(tasks: &mut Tasks, from: u32) -> LogPage {
    match tasks.ask(Body::Log { from }) {
        Ok(Reply::Log(page)) => page,
        other => panic!("{other:?}"),
    }
}

/// Bytes number `from` to `to` of a log that has its own number in each.
fn bytes(from: u32, to: u32) -> Vec<u8> {
    (from..to).map(|number| (number % 251) as u8).collect()
}

#[test]
fn a_host_reads_the_log_page_by_page_and_again_and_learns_what_it_was_too_late_for() {
    let mut tasks = Tasks::new(&settings(), 1);
    write_log(&bytes(0, 300));
    let first = page(&mut tasks, 0);
    assert_eq!((first.from, &first.bytes[..]), (0, &bytes(0, 256)[..]));
    assert_eq!(page(&mut tasks, 0), first);
    let second = page(&mut tasks, 256);
    assert_eq!(&second.bytes[..], &bytes(256, 300)[..]);
    assert!(page(&mut tasks, 300).bytes.is_empty());
    for part in 0..4 {
        write_log(&bytes(300 + 1000 * part, 1300 + 1000 * part));
        page(&mut tasks, 0);
    }
    let late = page(&mut tasks, 300);
    assert_eq!(late.from, 4300 - 2048);
    assert_eq!(&late.bytes[..], &bytes(late.from, late.from + 256)[..]);
}
