//! The circle test of ISO 230-4: two axes follow a circle together, once clockwise and once counter-clockwise, and
//! the true path is compared with the nominal one.
//!
//! # One circle
//! The stage leads in smoothly between two reversals, runs two whole turns at the full feed and leads out. The middle
//! 360 degrees count; the half turns before and after are the standard's feed-in and feed-out, and bring the friction and
//! the integrator into their steady cycle. The path is the plant's true one, which a ball-bar would feel, not the encoders'.
//!
//! # What is evaluated
//! The names and meanings of ISO 230-4:2005, as they are commonly given (we had the standard's published summary, not
//! its text):
//! - *Circular deviation* `G`: the least radial separation of two concentric circles that enclose the path, evaluated as
//!   its radial range about the centre of its least-squares circle. One for each sense.
//! - *Bi-directional circular deviation* `G(b)`: the same for the paths of both senses together, about one centre.
//! - *Radial deviation* `F`, by its extremes `Fmax` and `Fmin`: the path's distance from the nominal centre, less the
//!   nominal radius; outwards is positive.
//! - *Mean bi-directional radial deviation* `D`: the radius of the least-squares circle of both paths, less the nominal one.
//!   (A diameter's deviation is twice as large.)
//! - *Circular hysteresis* `H` (ISO 230-4:1996, dropped in 2005 for `G(b)`): the largest radial distance between the two
//!   paths at one angle, about the centre of the least-squares circle of both.
//! - *Reversal spike*: not in the standard; ball-bar instruments report it. Its definition is that of [`Spikes`].

mod cases;
mod figures;
pub mod page;
mod path;
mod request;
mod roundness;
mod single;
pub mod single_page;
mod spikes;
mod turn;

pub use path::Point;
pub use request::{CircleCase, CircleRequest, CircleResult, CircleTest, run_circle_tests};
pub use roundness::{Both, both};
pub use single::{CircleOutcome, FEED_MM_S, RADIUS_MM, run_circles};
pub use spikes::Spikes;
pub use turn::{CircleRefusal, NominalCircle, Turn, run_path, run_turn};
