//! Fault injection at a machine that is not real, beside the link: inputs, supply, and the log on the debug probe.

use std::io;

use quadrant_law::safety::Switches;
use quadrant_link::message;

/// Inputs, supply and log of a machine that is not a real one.
pub trait SimulatedIo {
    /// Holds these inputs pressed, beside those that the stage presses itself, and no others.
    fn press(&mut self, switches: Switches);

    /// Cuts the supply, lets the stage coast, and switches it on again; what is in flash stays.
    ///
    /// # Errors
    /// A machine that does not start.
    fn power_cycle(&mut self) -> io::Result<()>;

    /// The smallest and the largest position of each table so far, mm from where it stood at first, for judging; nothing, where
    /// that is not known.
    fn been_mm(&self) -> Option<[(f64, f64); 3]> {
        None
    }

    /// The lines that the firmware has logged since the last call; nothing, where there is no log.
    ///
    /// # Errors
    /// A log that cannot be read.
    fn log(&mut self) -> io::Result<Option<Vec<String>>>;
}

/// Digital inputs of a machine, by name; a simulated one's can be pressed.
pub const INPUTS: [(&str, Switches); message::INPUTS.len()] = {
    let mut inputs = [("", Switches::NONE); message::INPUTS.len()];
    let mut index = 0;
    while index < inputs.len() {
        let (name, bit) = message::INPUTS[index];
        inputs[index] = (name, Switches::from_bits(bit));
        index += 1;
    }
    inputs
};

/// Returns `pressed` without `released`.
pub const fn without(pressed: Switches, released: Switches) -> Switches {
    Switches::from_bits(pressed.bits() & !released.bits())
}

#[cfg(test)]
mod tests {
    use quadrant_law::axes::AxisName;
    use quadrant_law::safety::AxisSwitches;

    use super::*;

    #[test]
    fn every_input_has_a_name_and_bits_of_its_own() {
        let mut all = Switches::NONE;
        for (name, switches) in INPUTS {
            assert_eq!(all.bits() & switches.bits(), 0, "{name}");
            all = all.with(switches);
        }
        let limit = Switches::NONE.with_axis(AxisName::Y, AxisSwitches::POSITIVE_LIMIT);
        assert!(INPUTS.contains(&("y.positive-limit", limit)));
        assert!(
            without(all, Switches::EMERGENCY_STOP)
                .axis(AxisName::Y)
                .at_limit()
        );
        assert!(!without(all, Switches::EMERGENCY_STOP).emergency_stop());
    }
}
