//! Sections of the changelog.

/// Returns the text of a section, `Unreleased` or a version, without its heading; `None` if it is missing or empty.
pub(crate) fn section<'a>(changelog: &'a str, name: &str) -> Option<&'a str> {
    let heading = format!("## [{name}]");
    let mut at = 0;
    let mut start = None;
    for line in changelog.split_inclusive('\n') {
        if line.starts_with("## ") {
            if let Some(start) = start {
                return text(&changelog[start..at]);
            }
            if line.starts_with(&heading) {
                start = Some(at + line.len());
            }
        }
        at += line.len();
    }
    text(&changelog[start?..])
}

/// Returns the text without links' definitions at its end; `None` if nothing is left.
fn text(section: &str) -> Option<&str> {
    let section = section.find("\n[").map_or(section, |end| &section[..end]);
    let section = section.trim();
    (!section.is_empty()).then_some(section)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CHANGELOG: &str = "# Changelog\n\n## [Unreleased]\n\n### Added\n\n- a [link](x.md)\n\n## [0.2.0] - 2026-11-01\n\n- second\n\n\
                             ## [0.1.0] - 2026-10-01\n\n## [0.0.1] - 2026-09-01\n\n- first\n\n[0.0.1]: https://example.org\n";

    #[test]
    fn a_section_ends_where_the_next_begins() {
        assert_eq!(
            section(CHANGELOG, "Unreleased"),
            Some("### Added\n\n- a [link](x.md)")
        );
        assert_eq!(section(CHANGELOG, "0.2.0"), Some("- second"));
    }

    #[test]
    fn the_last_section_ends_before_the_definitions_of_links() {
        assert_eq!(section(CHANGELOG, "0.0.1"), Some("- first"));
    }

    #[test]
    fn an_empty_section_and_one_that_is_missing_are_none() {
        assert_eq!(section(CHANGELOG, "0.1.0"), None);
        assert_eq!(section(CHANGELOG, "0.3.0"), None);
    }
}
