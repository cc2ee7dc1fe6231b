//! The extension module `quadrant._quadrant`: bindings to the crates, by subject. The package `quadrant` beside it adds plots, data
//! frames and context managers, and documents them.

mod arrays;
mod axis;
mod errors;
mod interrupt;
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
    Ok(())
}
