//! Time-outs and idempotency of requests.

use std::time::Duration;

use quadrant_link::message::{Body, CaptureRequest, InjectRequest, SettingsRequest, StreamRequest};

/// Time for an answer: a request that computes little is served within two runs of the link's task, 2 ms, and a frame each way
/// takes 12 ms.
pub(super) const ANSWER: Duration = Duration::from_millis(150);

/// Time for an answer after which settings have been checked ([`CHECKED`]) and flash has been written, a sector of it erased.
const STORED: Duration = Duration::from_secs(16);

/// Time for an answer after which settings that were applied before have been built, in software where the processor knows
/// no double precision.
const BUILT: Duration = Duration::from_secs(2);

/// Time for an answer before which settings have been checked: in double precision, which the reference board's processor computes in
/// software. The simulated stage's take 163 million instructions (QEMU, Cortex-M4, `-icount shift=0`), 0.9 s at 180 MHz and one a cycle:
/// 49 million for the tables and leaves, 38 for the Popov bound of each set of linear gains, of which a schedule has four an axis:
/// 500 million. Flash is slower than one a cycle, and filters add to a bound.
const CHECKED: Duration = Duration::from_secs(10);

/// Time for which a request is repeated while the machine is busy.
pub(super) const BUSY: Duration = Duration::from_secs(2);
/// Pause between two of these requests.
pub(super) const BUSY_PAUSE: Duration = Duration::from_millis(5);

/// Effect of a request that is made twice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Idempotency {
    /// Nothing: it only asks. It may be made of a machine that has restarted, too.
    Query,
    /// The same as of one: it says what should be, or has a number.
    Idempotent,
    /// Something else: a second reset would clear another fault unseen, a second arming lose what was captured, and a request that
    /// enables the outputs or starts a motion is asked for by a person, each time: somebody at the machine may have switched
    /// off in between.
    NotIdempotent,
}

/// Returns the idempotency of a request.
pub(super) const fn idempotency(body: &Body) -> Idempotency {
    match body {
        Body::Hello
        | Body::Status
        | Body::Fault
        | Body::Inputs
        | Body::Learning
        | Body::Log { .. }
        | Body::Settings(
            SettingsRequest::Get(_)
            | SettingsRequest::GetInForce(_)
            | SettingsRequest::List { .. }
            | SettingsRequest::Edited { .. }
            | SettingsRequest::Provenance,
        )
        | Body::Capture(CaptureRequest::State | CaptureRequest::Read { .. }) => Idempotency::Query,
        // A later selection outdates an earlier one, whose blocks have another generation.
        Body::Telemetry(_)
        | Body::Disable
        | Body::Stop
        | Body::SetPlan(_)
        | Body::Spindle { .. }
        | Body::Stream(StreamRequest::Points { .. } | StreamRequest::Close)
        | Body::Inject(InjectRequest::Values { .. } | InjectRequest::Close)
        | Body::Settings(
            SettingsRequest::Set { .. } | SettingsRequest::Revert | SettingsRequest::Defaults,
        ) => Idempotency::Idempotent,
        Body::Jog { velocity_mm_s, .. } if *velocity_mm_s == 0.0 => Idempotency::Idempotent,
        Body::Enable
        | Body::Jog { .. }
        | Body::ResetFault
        | Body::Run
        | Body::Home(_)
        | Body::Move { .. }
        | Body::Stream(StreamRequest::Open { .. })
        | Body::Inject(InjectRequest::Open { .. })
        | Body::Settings(SettingsRequest::Apply | SettingsRequest::Store(_))
        | Body::Capture(CaptureRequest::Arm { .. } | CaptureRequest::Disarm)
        | Body::Reboot => Idempotency::NotIdempotent,
    }
}

/// Returns the time-out of the answer.
pub(super) const fn answer_timeout(body: &Body) -> Duration {
    match body {
        Body::Settings(SettingsRequest::Store(_)) => STORED,
        Body::Settings(SettingsRequest::Apply) => CHECKED,
        Body::Enable => BUILT,
        _ => ANSWER,
    }
}
