//! The numbers and names by which hosts and people know faults never change.

use quadrant_law::safety::FaultCode;

#[test]
fn numbers_and_names_are_stable() {
    let names: Vec<_> = FaultCode::ALL.iter().map(|code| code.name()).collect();
    assert_eq!(
        names,
        [
            "following-error",
            "encoder-jump",
            "deadline-missed",
            "emergency-stop",
            "negative-limit-switch",
            "positive-limit-switch",
            "travel-exceeded",
            "travel-ahead",
            "overspeed",
            "encoder-invalid",
            "encoder-silent",
            "index-mismatch",
            "stale-sample",
            "amplifier-fault",
            "output-mismatch",
            "link-lost",
            "stream-underrun",
            "watchdog-reset",
            "panic",
            "hard-fault",
            "settings-invalid",
            "home-switch-missing",
            "home-switch-stuck",
            "index-missing",
            "index-near-switch",
            "injection-underrun",
            "injection-bounds",
            "encoder-implausible",
            "stop-overrun",
            "overload",
            "oscillation",
            "pulse-overspeed",
            "pulse-jump",
        ]
    );
    for code in FaultCode::ALL {
        assert_eq!(FaultCode::from_number(code.number()), Some(code));
    }
    assert_eq!(FaultCode::from_number(0), None);
    assert_eq!(FaultCode::from_number(34), None);
}
