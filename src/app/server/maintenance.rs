//! Requests that control decides on: what is done while it keeps the outputs off, and the exchange of the plan.

use super::deferred::{Deferred, Work};
use super::{Server, refused};
use crate::app::queues::Order;
use crate::hal::SettingsFlash;
use quadrant_law::scalar::Scalar;
use quadrant_link::message::{LinkError, Message, Reply, Response};

impl<S: Scalar, F: SettingsFlash> Server<'_, '_, S, F> {
    /// Asks control for what the work needs, and puts the answer off. The reply returned is not sent.
    pub(super) fn defer(&mut self, work: Work) -> Result<Reply, LinkError> {
        match work {
            Work::Store(_) | Work::Restart => {
                if self.seen.view.safety.drives() {
                    return Err(outputs_on());
                }
                self.order(Order::Lock)?;
                self.locked = true;
            }
            Work::Plan(_) => self.order(Order::Plan)?,
        }
        self.deferred = Some(Deferred { id: 0, work });
        Ok(Reply::Done)
    }

    /// Does the work that was put off, once control has taken the order; returns true if its answer is prepared.
    pub(super) fn conclude(&mut self) -> bool {
        if !self.is_settled() {
            return false;
        }
        let Some(Deferred { id, work }) = self.deferred.take() else {
            return false;
        };
        let result = match work {
            Work::Plan(reach_mm) if self.seen.plan_taken => {
                self.plan_reach_mm = reach_mm;
                Ok(Reply::Done)
            }
            Work::Plan(_) => Err(refused(format_args!(
                "a motion is under way; stop it before the plan is exchanged"
            ))),
            _ if !self.seen.view.locked => Err(outputs_on()),
            Work::Store(provenance) => self.save(provenance),
            Work::Restart => {
                self.reboot = true;
                Ok(Reply::Done)
            }
        };
        self.transmit
            .fill(&Message::Response(Response { id, result }));
        true
    }

    /// Goes on where the board cannot restart itself.
    pub fn go_on(&mut self) {
        self.reboot = false;
    }

    /// Lets control enable the outputs again, once nothing needs them off.
    pub(super) fn release(&mut self) {
        let unlock = Order::Unlock {
            stored: self.accepted,
        };
        if self.locked && self.deferred.is_none() && !self.reboot && self.order(unlock).is_ok() {
            (self.locked, self.accepted) = (false, false);
        }
    }
}

fn outputs_on() -> LinkError {
    refused(format_args!("the outputs are on; disable them first"))
}
