//! The settings: every leaf, the whole set, what is built of it, and the set points of streams.

mod bytes;
mod cross_checks;
mod destinations;
mod draft;
mod fields;
mod leaves;
mod paths;
mod plan;
mod reference_stream;
mod stream_refusals;
mod tree;
mod whole_set;
