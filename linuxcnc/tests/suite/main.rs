//! Tests of the components by the functions that their C calls.
mod header;
