//! Doc comments say what a thing is or does, in plain sentences.

use crate::assert_none;
use crate::source::doc_comments;
use crate::tree::sources;

/// First words of a subordinate clause: what follows says neither what the thing is nor what it does.
const QUESTIONS: [&str; 20] = [
    "What",
    "How",
    "Whether",
    "Where",
    "Which",
    "When",
    "Who",
    "Why",
    "From which",
    "From what",
    "At which",
    "On which",
    "By which",
    "In which",
    "To which",
    "By how",
    "To what",
    "By what",
    "For which",
    "Of which",
];

fn begins_with_a_question(text: &str) -> bool {
    QUESTIONS.iter().any(|question| {
        text.strip_prefix(question)
            .is_some_and(|rest| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_'))
    })
}

#[test]
fn fewer_than_one_doc_comment_in_a_hundred_begins_with_a_question_word() {
    let mut all = 0;
    let mut found = Vec::new();
    for (file, source) in sources() {
        for (line, text, _) in doc_comments(&source) {
            all += 1;
            if begins_with_a_question(&text) {
                found.push(format!(
                    "{file}:{line}: {}",
                    text.lines().next().unwrap_or("")
                ));
            }
        }
    }
    if found.len() * 100 >= all {
        assert_none(&format!("question words, of {all} doc comments"), &found);
    }
}

#[test]
fn a_question_word_is_a_whole_word() {
    assert!(begins_with_a_question("How far the axis went."));
    assert!(begins_with_a_question("From which output on."));
    assert!(!begins_with_a_question("However it went."));
    assert!(!begins_with_a_question("The axis; what it did."));
}
