//! Random faults at random activities: `quadrant-studies faults` runs more of them.

use quadrant_studies::random_faults::judge;

#[test]
fn no_campaign_of_the_first_two_hundred_breaks_what_must_hold() {
    let lines: Vec<_> = (1..=200).map(judge).collect();
    let broken: Vec<_> = lines
        .iter()
        .filter(|line| !line.broken.is_empty())
        .collect();
    assert!(broken.is_empty(), "{broken:#?}");
    // They do provoke something.
    let faulted = lines.iter().filter(|line| line.fault.is_some()).count();
    let cut = lines
        .iter()
        .filter(|line| line.was_cut == Some(true))
        .count();
    assert!(faulted > 60 && cut > 5, "{faulted} faults, {cut} cuts");
}
