//! Requests that switch outputs and start motions.

use super::deferred::Work;
use super::{Server, busy, index, invalid, refused};
use crate::app::queues::Order;
use crate::app::wire::Translated;
use crate::hal::SettingsFlash;
use quadrant_law::admission;
use quadrant_law::axes::{AxisName, PerAxis};
use quadrant_law::cancelling::{MOST_RPM, SpindleSpeed};
use quadrant_law::command::Command;
use quadrant_law::decimal::Decimal;
use quadrant_law::reference::{Motion, MotionSettings};
use quadrant_law::safety::Station;
use quadrant_law::scalar::Scalar;
use quadrant_link::message::{Body, LinkError, Plan, Reply, text};
use quadrant_settings::{PlanSettings, StageSettings, reach_mm};

impl<S: Scalar, F: SettingsFlash> Server<'_, '_, S, F> {
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
                self.command(Command::Stop)?;
                self.stream = None;
                self.give_up_injection();
            }
            Body::Run => {
                self.check(Command::Run)?;
                self.check_plan()?;
                self.order(Order::Command(Command::Run))?;
            }
            Body::Home(axes) => {
                for axis in axes.iter().map(AxisName::translated) {
                    self.check(Command::Home(axis))?;
                    let known = self.in_force()?.can_home(axis);
                    known.map_err(|error| refused(format_args!("{error}")))?;
                }
                for axis in axes.iter().map(AxisName::translated) {
                    self.command(Command::Home(axis))?;
                }
            }
            Body::Jog {
                axis,
                velocity_mm_s,
            } => {
                let axis = Translated::translated(axis);
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

    /// Returns the settings that motions are checked against, if control has them.
    pub(super) fn in_force(&self) -> Result<&StageSettings, LinkError> {
        if self.is_exchanging() {
            return Err(refused(format_args!(
                "settings that were applied wait until the outputs are off; disable them first"
            )));
        }
        Ok(self.draft.in_force())
    }

    /// Checks that the plan moves an axis, and that no homed axis would leave its travel.
    pub(super) fn check_plan(&self) -> Result<(), LinkError> {
        if !self.seen.planned {
            return Err(refused(format_args!(
                "there is no plan: send one; settings that change with the outputs off drop the one before"
            )));
        }
        let settings = self.in_force()?;
        for axis in AxisName::ALL {
            let seen = &self.seen.axes[index(axis)];
            if self.seen.view.homed[index(axis)] {
                settings
                    .check_reach(axis, seen.ahead, self.plan_reach_mm[axis])
                    .map_err(|error| invalid(format_args!("{error}")))?;
            }
        }
        Ok(())
    }

    /// Checks that the control law would take a command, as far as the last snapshot shows.
    pub(super) fn check(&self, command: Command) -> Result<(), LinkError> {
        match admission::refusal_from(Station::Host, self.seen.view, command) {
            Some(reason) => Err(refused(format_args!("{reason}"))),
            None => Ok(()),
        }
    }

    /// Sends a command to the control law, unless it would not take it.
    pub(super) fn command(&mut self, command: Command) -> Result<(), LinkError> {
        self.check(command)?;
        self.order(Order::Command(command))
    }

    /// Sends an order to the control law.
    pub(super) fn order(&mut self, order: Order) -> Result<(), LinkError> {
        self.ends.orders.enqueue(order).map_err(|_| {
            busy(format_args!(
                "the control law has orders waiting; ask again"
            ))
        })?;
        self.orders = self.orders.wrapping_add(1);
        Ok(())
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
            .in_force()?
            .move_to(axis, ahead, homed, target_mm, velocity_mm_s)
            .map_err(|error| invalid(format_args!("{error}")))?;
        let mut motions = [MotionSettings::Hold; 3];
        motions[index(axis)] = MotionSettings::PointToPoint(motion);
        self.queue_plan(&PlanSettings { motions })?;
        self.order(Order::Move(axis))?;
        Ok(Reply::Done)
    }

    /// Passes the speed of the spindle on.
    pub(super) fn set_spindle(&mut self, rpm: f64) -> Result<Reply, LinkError> {
        if !(0.0..=MOST_RPM).contains(&rpm) {
            return Err(invalid(format_args!(
                "rpm: {} is outside 0 to {}",
                Decimal(rpm),
                Decimal(MOST_RPM)
            )));
        }
        let period_s = 1.0 / self.draft.in_force().rate_hz;
        self.order(Order::Spindle(SpindleSpeed::from_rpm(rpm, period_s)))?;
        Ok(Reply::Done)
    }

    /// Replaces the plan, as a whole or not at all.
    #[inline(never)]
    pub(super) fn set_plan(&mut self, plan: Plan) -> Result<Reply, LinkError> {
        if self.seen.view.running {
            return Err(refused(format_args!(
                "a motion is under way; stop it before the plan is exchanged"
            )));
        }
        let plan = PlanSettings::translated(plan);
        self.queue_plan(&plan)?;
        let reach_mm = PerAxis::from_fn(|axis| reach_mm(&plan.motions[index(axis)]));
        self.defer(Work::Plan(reach_mm))
    }

    /// Plans motions that keep to their axes' limits where control takes them from when it is ordered to.
    #[inline(never)]
    fn queue_plan(&mut self, plan: &PlanSettings) -> Result<(), LinkError> {
        let settings = self.in_force()?;
        plan.validate(settings)
            .map_err(|error| invalid(format_args!("{error}")))?;
        let plan = PerAxis::from_fn(|axis| {
            Motion::build(&plan.motions[index(axis)], settings.scale_of(axis))
        });
        self.ends.plans.enqueue(plan).map_err(|_| {
            busy(format_args!(
                "the control law has motions waiting; ask again"
            ))
        })
    }
}
