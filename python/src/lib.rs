//! The extension module `quadrant._quadrant`: bindings to the crates, by subject. The package `quadrant` beside it adds plots, data
//! frames and context managers, and documents them.

mod arrays;
mod axis;
mod commission;
mod design;
mod errors;
mod friction;
mod identify;
mod interrupt;
mod json;
mod machine;
mod records;
mod references;
mod settings;
mod simulate;
mod stage;

use pyo3::prelude::*;

/// Makes the module.
#[pymodule]
#[pyo3(name = "_quadrant")]
fn quadrant(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<settings::Settings>()?;
    module.add_class::<references::Motion>()?;
    module.add_class::<axis::Axis>()?;
    module.add_class::<stage::Stage>()?;
    module.add_class::<stage::SimulatedAxis>()?;
    module.add_function(wrap_pyfunction!(simulate::simulate, module)?)?;
    module.add_function(wrap_pyfunction!(simulate::simulate_many, module)?)?;
    module.add_class::<design::DesignProcess>()?;
    module.add_class::<identify::MotionModels>()?;
    module.add_class::<machine::Session>()?;
    module.add_function(wrap_pyfunction!(commission::commission_simulated, module)?)?;
    module.add_function(wrap_pyfunction!(commission::measure_frf_simulated, module)?)?;
    module.add_function(wrap_pyfunction!(design::design_pid, module)?)?;
    module.add_function(wrap_pyfunction!(design::margins, module)?)?;
    module.add_function(wrap_pyfunction!(design::load_error, module)?)?;
    module.add_function(wrap_pyfunction!(design::open_loop, module)?)?;
    module.add_function(wrap_pyfunction!(design::popov, module)?)?;
    module.add_function(wrap_pyfunction!(design::npid, module)?)?;
    module.add_function(wrap_pyfunction!(friction::friction_static, module)?)?;
    module.add_function(wrap_pyfunction!(friction::friction_force, module)?)?;
    module.add_function(wrap_pyfunction!(friction::virgin_curve, module)?)?;
    module.add_function(wrap_pyfunction!(friction::fit_hysteresis, module)?)?;
    module.add_function(wrap_pyfunction!(friction::fit_runs, module)?)?;
    module.add_function(wrap_pyfunction!(friction::fit_single_state, module)?)?;
    module.add_function(wrap_pyfunction!(identify::frf, module)?)?;
    module.add_function(wrap_pyfunction!(identify::fit_tf, module)?)?;
    module.add_function(wrap_pyfunction!(identify::plant_response, module)?)?;
    module.add_function(wrap_pyfunction!(identify::motor_constant, module)?)?;
    module.add_function(wrap_pyfunction!(identify::fit_motion, module)?)?;
    module.add_function(wrap_pyfunction!(records::read_recording, module)?)?;
    module.add_function(wrap_pyfunction!(records::write_recording, module)?)?;
    Ok(())
}
