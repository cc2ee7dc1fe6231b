//! `commission`: the connected axis from unknown to settings that it runs on, by the code of `quadrant commission`.

use quadrant_host::client::Client;

use super::answer::Answer;
use super::command::CommissionOptions;
use crate::commission::Job;

pub(super) fn run(client: &mut Client, options: &CommissionOptions) -> anyhow::Result<Answer> {
    let job = Job {
        axis: options.axis.into(),
        travel: options.travel,
        stage: None,
        start: None,
        into: None,
        request: &options.request,
        output: &options.output,
        apply: options.apply,
        store: options.store,
    };
    let done = job.run(client)?;
    Ok(Answer {
        failure: done.failure,
        ..Answer::new(done.text.trim_end(), done.data)
    })
}
