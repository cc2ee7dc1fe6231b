//! Just enough Markdown: code spans, fenced code, links, headings.

/// A piece of a text, with its line.
pub(crate) type Piece = (usize, String);

/// The pieces of a text that the checks look at.
#[derive(Debug, Default)]
pub(crate) struct Pieces {
    /// Contents of code spans.
    pub(crate) spans: Vec<Piece>,
    /// Lines of fenced code that is shell or names no language.
    pub(crate) code: Vec<Piece>,
    /// Targets of links.
    pub(crate) links: Vec<Piece>,
    /// Headings as anchors.
    pub(crate) anchors: Vec<String>,
}

/// Takes a text apart whose first line has the number `first_line`.
pub(crate) fn pieces(text: &str, first_line: usize) -> Pieces {
    let mut found = Pieces::default();
    let mut fence: Option<bool> = None;
    let mut paragraph = String::new();
    let mut start = first_line;
    for (number, line) in (first_line..).zip(text.lines()) {
        let trimmed = line.trim();
        if let Some(language) = trimmed.strip_prefix("```") {
            end_paragraph(&mut paragraph, start, &mut found);
            fence = match fence {
                Some(_) => None,
                // A second word says how long it takes: `sh long`.
                None => {
                    Some(["", "sh", "console"].contains(&language.split(' ').next().unwrap_or("")))
                }
            };
        } else if let Some(shell) = fence {
            if shell {
                found.code.push((number, trimmed.to_owned()));
            }
        } else {
            let heading = trimmed.starts_with('#');
            if trimmed.is_empty() || heading || trimmed.starts_with('|') {
                end_paragraph(&mut paragraph, start, &mut found);
            }
            if paragraph.is_empty() {
                start = number;
            }
            paragraph.push_str(trimmed);
            paragraph.push('\n');
            if heading {
                found.anchors.push(anchor(trimmed.trim_start_matches('#')));
                end_paragraph(&mut paragraph, start, &mut found);
            }
        }
    }
    end_paragraph(&mut paragraph, start, &mut found);
    found
}

fn end_paragraph(paragraph: &mut String, start: usize, found: &mut Pieces) {
    let mut prose = String::new();
    let mut line = start;
    for (index, part) in paragraph.split('`').enumerate() {
        if index % 2 == 1 {
            found.spans.push((line, part.replace('\n', " ")));
        } else {
            prose.push_str(part);
        }
        let lines = part.matches('\n').count();
        if index % 2 == 1 {
            prose.extend(std::iter::repeat_n('\n', lines));
        }
        line += lines;
    }
    for (at, _) in prose.match_indices("](") {
        let target = &prose[at + 2..];
        if let Some(end) = target.find([')', ' ']) {
            let line = start + prose[..at].matches('\n').count();
            found.links.push((line, target[..end].to_owned()));
        }
    }
    paragraph.clear();
}

/// The anchor that forges and mdBook give to a heading.
fn anchor(heading: &str) -> String {
    heading
        .trim()
        .chars()
        .filter_map(|character| match character {
            ' ' | '-' => Some('-'),
            '_' => Some('_'),
            _ if character.is_alphanumeric() => Some(character.to_ascii_lowercase()),
            _ => None,
        })
        .collect()
}

#[test]
fn spans_over_two_lines_links_and_anchors_are_found() {
    let text = "# N-PID can hunt, *or* not\nRun `quadrant\ncompare`, see [x](a.md#b).\n```sh\ncargo board # flash\n```\n";
    let found = pieces(text, 1);
    assert_eq!(found.anchors, ["n-pid-can-hunt-or-not"]);
    assert_eq!(found.spans, [(2, "quadrant compare".to_owned())]);
    assert_eq!(found.links, [(3, "a.md#b".to_owned())]);
    assert_eq!(found.code, [(5, "cargo board # flash".to_owned())]);
}
