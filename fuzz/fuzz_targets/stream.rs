//! Raw bytes before the port: the receiver, COBS, CRC.
#![no_main]

#[allow(dead_code)]
#[path = "../../crates/link/tests/suite/fuzz.rs"]
mod fuzz;
#[allow(dead_code)]
#[path = "../../crates/link/tests/suite/model.rs"]
mod model;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let mut served = model::Model::default();
    fuzz::stream(data, |body| served.serve(body));
});
