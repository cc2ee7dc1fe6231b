//! Settings of serial encoders, on a board that reads one for x.

use quadrant_fault_bench::tasks::Tasks;
use quadrant_link::message::{Body, LinkError, Reply, SettingsRequest};
use quadrant_settings::{SerialSettings, StageSettings};

use crate::preemption::set;

#[test]
fn a_board_that_reads_no_serial_encoder_of_an_axis_refuses_it_by_name() {
    let mut given = StageSettings::simulated();
    for axis in &mut given.axes {
        axis.encoder.serial = Some(SerialSettings::default());
        axis.encoder.counts_per_index = None;
        axis.homing.as_mut().expect("by default").index = false;
    }
    for (axis, read) in [("x", true), ("y", false), ("z", false)] {
        let mut tasks = Tasks::new(&StageSettings::simulated(), 1);
        for part in ["homing/index", "encoder/counts_per_index", "encoder/serial"] {
            let path = format!("/axes/{axis}/{part}");
            tasks.ask(set(&path, &given)).expect("a setting");
        }
        match tasks.ask(Body::Settings(SettingsRequest::Apply)) {
            Ok(Reply::Applied(applied)) => assert!(read && applied.restart_needed, "{axis}"),
            Err(LinkError::Invalid(text)) => assert!(
                !read && text.starts_with(&format!("{axis}/encoder/serial: this board reads no")),
                "{text}"
            ),
            answer => panic!("{axis}: {answer:?}"),
        }
    }
}
