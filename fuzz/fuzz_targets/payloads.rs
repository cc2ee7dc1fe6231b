//! Payloads that any CRC is right for: decoding, sessions, and the server.
#![no_main]

#[allow(dead_code)]
#[path = "../../tests/law/link_fuzz.rs"]
mod link_fuzz;
#[allow(dead_code)]
#[path = "../../tests/law/link_model.rs"]
mod link_model;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let mut model = link_model::Model::default();
    link_fuzz::payloads(data, |body| model.serve(body));
});
