//! Tables and figures of a commissioning, and of its plan.

mod page;
mod plan;

pub use page::{commission_page, gains_table, results_table};
pub use plan::plan_table;
