//! Requests that switch outputs and start motions.

use embedded_storage::nor_flash::NorFlash;

use super::{Server, busy, index, invalid, refused};
use crate::app::supervisor;
use crate::law::axes::AxisName;
use crate::law::command::Command;
use crate::law::reference::{Motion, MotionSettings};
use crate::law::scalar::Scalar;
use crate::settings::PlanSettings;
use quadrant_link::message::{Body, LinkError, Plan, Reply, text};

impl<S: Scalar, F: NorFlash> Server<'_, '_, S, F> {
    /// Requests that are commands of the control law.
    #[inline(never)]
    pub(super) fn serve_command(&mut self, body: Body) -> Result<Reply, LinkError> {
        match body {
            Body::Enable => {
                self.command(Command::Enable)?;
                self.arm_for_faults();
            }
            Body::Disable => self.command(Command::Disable)?,
            Body::ResetFault => self.command(Command::ResetFault)?,
            Body::Stop => {
                self.stream = None;
                self.command(Command::Stop)?;
                self.give_up_injection();
            }
            Body::Run => self.command(Command::Run)?,
            Body::Home(axes) => {
                for axis in axes.iter().map(AxisName::from) {
                    self.check(Command::Home(axis))?;
                    let known = self.draft.in_force().can_home(axis);
                    known.map_err(|error| refused(format_args!("{error}")))?;
                }
                for axis in axes.iter().map(AxisName::from) {
                    self.command(Command::Home(axis))?;
                }
            }
            Body::Jog {
                axis,
                velocity_mm_s,
            } => {
                let axis = axis.into();
                let velocity = self
                    .draft
                    .in_force()
                    .jog_at(axis, velocity_mm_s)
                    .map_err(|error| invalid(format_args!("{error}")))?;
                self.command(Command::Jog(axis, velocity))?;
            }
            other => {
                return Err(LinkError::Unsupported(text(format_args!(
                    "{}",
                    other.name()
                ))));
            }
        }
        Ok(Reply::Done)
    }

    /// Checks that the control law would take a command, as far as the last snapshot tells.
    pub(super) fn check(&self, command: Command) -> Result<(), LinkError> {
        match supervisor::refusal(self.seen.view, command) {
            Some(reason) => Err(refused(format_args!("{reason}"))),
            None => Ok(()),
        }
    }

    /// Sends a command to the control law, unless it would not take it.
    pub(super) fn command(&mut self, command: Command) -> Result<(), LinkError> {
        self.check(command)?;
        self.ends.commands.enqueue(command).map_err(|_| {
            busy(format_args!(
                "the control law has commands waiting; ask again"
            ))
        })
    }

    /// Moves one axis to a position.
    #[inline(never)]
    pub(super) fn start_move(
        &mut self,
        axis: AxisName,
        target_mm: f64,
        velocity_mm_s: f64,
    ) -> Result<Reply, LinkError> {
        self.check(Command::StartMove(axis))?;
        let (ahead, homed) = (
            self.seen.axes[index(axis)].ahead,
            self.seen.view.homed[index(axis)],
        );
        let motion = self
            .draft
            .in_force()
            .move_to(axis, ahead, homed, target_mm, velocity_mm_s)
            .map_err(|error| invalid(format_args!("{error}")))?;
        self.hand_over(axis, &MotionSettings::PointToPoint(motion))?;
        self.command(Command::StartMove(axis))?;
        Ok(Reply::Done)
    }

    /// Replaces the plan.
    #[inline(never)]
    pub(super) fn set_plan(&mut self, plan: Plan) -> Result<Reply, LinkError> {
        if self.seen.view.running {
            return Err(refused(format_args!(
                "a motion is under way; stop it before the plan is exchanged"
            )));
        }
        let plan = PlanSettings::from(plan);
        plan.validate(self.draft.in_force())
            .map_err(|error| invalid(format_args!("{error}")))?;
        for (axis, motion) in AxisName::ALL.into_iter().zip(&plan.motions) {
            self.hand_over(axis, motion)?;
        }
        Ok(Reply::Done)
    }

    #[inline(never)]
    fn hand_over(&mut self, axis: AxisName, motion: &MotionSettings) -> Result<(), LinkError> {
        let motion = Motion::build(motion, self.draft.in_force().scale_of(axis));
        self.ends.motions.enqueue((axis, motion)).map_err(|_| {
            busy(format_args!(
                "the control law has motions waiting; ask again"
            ))
        })
    }
}
