//! Raw bytes before the port: the receiver, COBS, CRC.
#![no_main]

#[allow(dead_code)]
#[path = "../../tests/law/link_fuzz.rs"]
mod link_fuzz;
#[allow(dead_code)]
#[path = "../../tests/law/link_model.rs"]
mod link_model;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let mut model = link_model::Model::default();
    link_fuzz::stream(data, |body| model.serve(body));
});
