//! Chapter 5: its runs, and what is made of them.

use std::collections::HashMap;

use quadrant_pages::compare::comparison::{AMPLITUDES_MM, Comparison, Entry, Request};
use quadrant_pages::compare::sine::{Sines, VELOCITIES_MM_S};
use quadrant_pages::experiment::configuration::Configuration;
use quadrant_pages::experiment::run_configuration::{ModelKnowledge, RunConfiguration};
use quadrant_pages::parts::provenance;
use quadrant_report::{Block, Cell, Page, Section, Table};
use quadrant_sim::identified_stage::identified_settings;
use quadrant_sim::metrics::Score;
use quadrant_sim::run::AxisTrace;
use quadrant_studies::thesis::chapter5::chapter5_sections;
use quadrant_studies::thesis::headline::{headline_section, study_section};
use quadrant_studies::thesis::imperfections::{Change, study};

/// A comparison with scores that distinguish the entries: 100 um for PID alone and for the best PID, half of it under N-PID, a tenth of what
/// was there with each further feedforward; two seeds, 1 % apart.
fn made_up() -> Comparison {
    let mut entries = Vec::new();
    for knowledge in ModelKnowledge::ALL {
        for amplitude_mm in AMPLITUDES_MM {
            let thesis = Configuration::all().into_iter().enumerate();
            for (index, configuration) in thesis.chain([(0, Configuration::BEST_PID)]) {
                for velocity_mm_s in VELOCITIES_MM_S {
                    let halved = if index >= 4 { 0.5 } else { 1.0 };
                    let largest_mm = 0.1 * halved * 0.1_f64.powi(index as i32 % 4);
                    let score = |factor: f64| Score {
                        largest_mm: factor * largest_mm,
                        rms_mm: factor * 0.2 * largest_mm,
                        glitch_mm: factor * 0.9 * largest_mm,
                    };
                    entries.push(Entry {
                        configuration,
                        knowledge,
                        amplitude_mm,
                        velocity_mm_s,
                        scores: vec![score(0.995), score(1.005)],
                        last_cycle: AxisTrace {
                            reference_mm: vec![0.0; 100],
                            error_mm: (0..100)
                                .map(|k| largest_mm * (f64::from(k) / 8.0).sin())
                                .collect(),
                            output_v: Vec::new(),
                        },
                    });
                }
            }
        }
    }
    Comparison::from(entries)
}

fn labels(sections: &[Section]) -> HashMap<String, Vec<&Block>> {
    let mut found: HashMap<String, Vec<&Block>> = HashMap::new();
    for block in sections.iter().flat_map(|section| &section.blocks) {
        let Block::Labelled { label, block } = block else {
            panic!("a block without a number: {block:?}");
        };
        found.entry(label.clone()).or_default().push(block);
    }
    found
}

fn table<'a>(found: &'a HashMap<String, Vec<&Block>>, label: &str) -> &'a Table {
    match found[label][..] {
        [Block::Table(table)] => table,
        _ => panic!("{label}"),
    }
}

fn number(table: &Table, row: usize, heading: &str) -> f64 {
    let place = table
        .columns
        .iter()
        .position(|column| column.heading == heading);
    match table.rows[row][place.unwrap_or_else(|| panic!("{heading}: {:?}", table.columns))] {
        Cell::Number { value, .. } => value,
        _ => f64::NAN,
    }
}

#[test]
fn every_table_and_figure_of_the_chapter_is_there_once() {
    let sections = chapter5_sections(&made_up());
    let found = labels(&sections);
    for number in 1..=22 {
        assert_eq!(
            found[&format!("Table 5.{number}")].len(),
            1,
            "Table 5.{number}"
        );
    }
    for number in 1..=18 {
        let whole = format!("Figure 5.{number}");
        let parts = found.keys().filter(|label| {
            **label == whole || (label.starts_with(&whole) && label.ends_with(['a', 'b', 'c']))
        });
        let expected = match number {
            5 => 3,
            6..=17 => 2,
            _ => 1,
        };
        let parts: Vec<_> = parts
            .filter(|label| label.trim_end_matches(['a', 'b', 'c']) == whole)
            .collect();
        assert_eq!(parts.len(), expected, "{parts:?}");
    }
    let page = Page {
        title: String::new(),
        subtitle: String::new(),
        provenance: provenance("quadrant-studies report", 1),
        sections,
    };
    page.to_html().unwrap();
}

#[test]
fn tables_hold_means_deviations_and_changes_of_the_right_entries() {
    let sections = chapter5_sections(&made_up());
    let found = labels(&sections);
    let close = |value: f64, expected: f64| {
        assert!(
            (value - expected).abs() < 1e-6 * expected.abs().max(1.0),
            "{value} {expected}"
        );
    };
    let alone = table(&found, "Table 5.3");
    assert_eq!(alone.rows.len(), 3);
    close(number(alone, 0, "Largest PID"), 100.0);
    close(number(alone, 0, "Largest N-PID"), 50.0);
    close(number(alone, 0, "±"), 100.0 * 0.01 / 2.0_f64.sqrt());
    close(number(alone, 0, "Change"), -50.0);
    // Twelve rows: each velocity with each feedforward; the third of each four is GMS.
    let feedforwards = table(&found, "Table 5.11");
    assert_eq!(feedforwards.rows.len(), 12);
    close(number(feedforwards, 2, "Largest"), 0.5);
    close(number(feedforwards, 2, "Change"), -99.0);
    let simulated = table(&found, "Table 5.5");
    // With PID the best one follows each four.
    assert_eq!(simulated.rows.len(), 15);
    close(number(simulated, 9, "Largest"), 100.0);
    close(number(simulated, 9, "Change"), 0.0);
    assert!(simulated.columns.iter().all(|column| column.heading != "±"));
    let glitches = table(&found, "Table 5.16");
    close(number(glitches, 3, "Glitch PID"), 0.09);
    close(number(glitches, 3, "Change"), -50.0);
    let amplitudes = table(&found, "Table 5.22");
    assert_eq!(amplitudes.rows.len(), 12);
    close(number(amplitudes, 0, "Change"), -99.9);
}

#[test]
fn the_headline_table_sets_ours_beside_the_thesis() {
    let section = headline_section(&made_up());
    let [Block::Table(changes), Block::Table(best)] = &section.blocks[..] else {
        panic!("{:?}", section.blocks);
    };
    let close = |value: f64, expected: f64| assert!((value - expected).abs() < 1e-6, "{value}");
    close(number(changes, 0, "Thesis"), -25.0);
    close(number(changes, 0, "Friction identified"), -50.0);
    close(number(changes, 0, "±"), 0.0);
    close(number(changes, 5, "Friction known"), 100.0 * (0.5e-3 - 1.0));
    assert_eq!(changes.rows.len(), 9);
    assert!(matches!(changes.rows[7][2], Cell::Missing));
    close(number(changes, 7, "Friction known"), 100.0 * (0.5e-3 - 1.0));
    assert_eq!(best.rows.len(), 9);
    close(number(best, 0, "Best, friction identified"), 0.05);
}

#[test]
fn the_same_runs_on_one_thread_and_on_three_give_the_same_scores() {
    let setups = RunConfiguration::both(&identified_settings().unwrap().stage);
    let request = Request {
        setups: &setups,
        configurations: &Configuration::EXTREMES,
        sines: vec![Sines::of_amplitude(1.0)],
        seed: 5,
        seeds: 3,
    };
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let comparison = pool.install(|| request.run(&|_| {})).unwrap();
        comparison
            .entries()
            .iter()
            .map(|entry| (entry.scores.clone(), entry.last_cycle.error_mm.clone()))
            .collect::<Vec<_>>()
    };
    let one = on(1);
    assert!(one == on(3));
    // Further seeds are other noise.
    let (scores, _) = &one[one.len() - 1];
    assert_ne!(scores[0], scores[1]);
}

#[test]
fn switching_an_imperfection_off_changes_that_and_nothing_else() {
    let [_, setup] = RunConfiguration::both(&identified_settings().unwrap().stage);
    let quiet = Change::NoNoise.apply(&setup, 1).unwrap();
    assert_eq!(quiet.stage, setup.stage);
    for (quiet, axis) in quiet.truth.axes.iter().zip(&setup.truth.axes) {
        let mut back = quiet.clone();
        assert_eq!(back.imperfections.encoder_noise_mm, 0.0);
        back.imperfections.encoder_noise_mm = axis.imperfections.encoder_noise_mm;
        assert_eq!(back, *axis);
    }
    let known = Change::TrueFriction.apply(&setup, 1).unwrap();
    assert_eq!(known.truth, setup.truth);
    assert_eq!(
        known.stage.axes[0].friction,
        RunConfiguration::exact(setup.stage.clone()).stage.axes[0].friction
    );
    assert_eq!(known.stage.axes[0].feedback, setup.stage.axes[0].feedback);
    let finer = Change::Elements(6).apply(&setup, 1).unwrap();
    assert_eq!(finer.truth, setup.truth);
    assert_eq!(finer.stage.axes[0].friction.gms.elements.len(), 6);
    assert_eq!(
        finer.stage.axes[0].friction.sliding,
        setup.stage.axes[0].friction.sliding
    );
}

#[test]
fn an_identification_that_fails_is_reported_and_the_others_are_shown() {
    let [_, setup] = RunConfiguration::both(&identified_settings().unwrap().stage);
    let findings = study(
        &setup,
        &[Change::AsItIs, Change::Elements(11)],
        1,
        1,
        &|_| {},
    )
    .unwrap();
    let section = study_section(&findings);
    assert!(
        section
            .prose
            .iter()
            .any(|line| line.contains("11 elements; a GMS model has 1 to 10")),
        "{:?}",
        section.prose
    );
    let [Block::Table(table)] = &section.blocks[..] else {
        panic!("{:?}", section.blocks);
    };
    assert!(number(table, 0, "Largest, mean") < -80.0);
    assert!(number(table, 1, "Largest, mean").is_nan());
}
