//! Payloads that any CRC is right for: decoding, sessions, and the server.
#![no_main]

#[allow(dead_code)]
#[path = "../../crates/link/tests/suite/fuzz.rs"]
mod fuzz;
#[allow(dead_code)]
#[path = "../../crates/link/tests/suite/model.rs"]
mod model;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let mut served = model::Model::default();
    fuzz::payloads(data, |body| served.serve(body));
});
