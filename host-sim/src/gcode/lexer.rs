//! From text to words: the grammar is the crate `gcode`'s, whose errors and spans are used; its numbers are not, because
//! they are `f32`, which is 4 um at 50 mm in the seventh digit.

use gcode::core::{
    BlockVisitor, CommandVisitor, ControlFlow, Diagnostics, Number, ProgramVisitor, Span,
    TokenType, Value, parse,
};

use crate::gcode::error::ProgramError;

/// A letter with its number.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Word {
    pub(super) letter: char,
    pub(super) value: f64,
    /// As it is written, without spaces.
    pub(super) text: String,
    /// Its line, from 1.
    pub(super) line: usize,
}

/// The words of a program in order, without comments and line numbers.
///
/// # Errors
/// The first text that is not G-code.
pub(super) fn words(source: &str) -> Result<Vec<Word>, ProgramError> {
    refuse_bad_codes(source)?;
    let mut reader = Reader {
        source,
        words: Vec::new(),
        error: None,
    };
    parse(source, &mut reader);
    match reader.error {
        None => Ok(reader.words),
        Some(error) => Err(error),
    }
}

/// Digits of a code's number that `gcode` multiplies by ten in 32 bits without overflow.
const CODE_DIGITS: usize = 8;

/// Refuses codes that `gcode` 0.7 would drop without a word or overflow on: it reports a code's bad number by a type that
/// it keeps private.
fn refuse_bad_codes(source: &str) -> Result<(), ProgramError> {
    for (index, line) in source.lines().enumerate() {
        let line_text = without_comments(line);
        for (place, _) in line_text.match_indices(['G', 'g', 'M', 'm', 'T', 't']) {
            let rest = line_text[place + 1..].trim_start_matches([' ', '\t']);
            let end = rest
                .find(|c: char| !(c.is_ascii_digit() || c == '.'))
                .unwrap_or(rest.len());
            let (whole, decimals) = match rest[..end].split_once('.') {
                None => (&rest[..end], None),
                Some((whole, decimals)) => (whole, Some(decimals)),
            };
            // A code without a number is the parser's to refuse.
            let good = whole.len() <= CODE_DIGITS
                && decimals.is_none_or(|decimals| decimals.len() == 1 && !whole.is_empty());
            if !good {
                return Err(ProgramError::Syntax {
                    line: index + 1,
                    text: line.trim().to_owned(),
                    detail: format!(
                        "a code is a whole number of at most {CODE_DIGITS} digits, or has one decimal"
                    ),
                });
            }
        }
    }
    Ok(())
}

/// A line without what stands in parentheses or after a semicolon.
fn without_comments(line: &str) -> String {
    let mut depth = 0usize;
    let mut rest = String::new();
    for character in line.chars() {
        match (character, depth) {
            ('(', _) => depth += 1,
            (')', 1..) => depth -= 1,
            (';', 0) => break,
            (_, 0) => rest.push(character),
            _ => {}
        }
    }
    rest
}

/// The largest magnitude of a word's number: beyond every machine's travel, in any unit, and every feed.
const LARGEST: f64 = 1e6;

/// Collects words, and the first error.
struct Reader<'s> {
    source: &'s str,
    words: Vec<Word>,
    error: Option<ProgramError>,
}

impl Reader<'_> {
    fn fail(&mut self, text: &str, span: Span, detail: String) {
        self.error.get_or_insert_with(|| ProgramError::Syntax {
            line: span.line + 1,
            text: text.trim().to_owned(),
            detail,
        });
    }

    fn word(&mut self, letter: char, span: Span) {
        let text: String = self.source[span.start..span.end()]
            .chars()
            .filter(|c| !c.is_whitespace())
            .collect();
        match text[letter.len_utf8()..].parse::<f64>() {
            Ok(value) if value.abs() > LARGEST => {
                self.fail(&text, span, format!("its number is beyond {LARGEST}"))
            }
            Ok(value) => self.words.push(Word {
                letter: letter.to_ascii_uppercase(),
                value,
                text,
                line: span.line + 1,
            }),
            Err(_) => self.fail(&text, span, "a number should follow the letter".to_owned()),
        }
    }

    fn code(&mut self, letter: char, number: Number) {
        let minor = number.minor().map_or(0, std::num::NonZero::get);
        self.words.push(Word {
            letter,
            value: f64::from(number.major()) + 0.1 * f64::from(minor),
            text: format!("{letter}{number}"),
            // Known when the command ends.
            line: 0,
        });
    }
}

impl Diagnostics for Reader<'_> {
    fn emit_unknown_content(&mut self, text: &str, span: Span) {
        self.fail(text, span, "it is no word of G-code".to_owned());
    }

    fn emit_unexpected(&mut self, actual: &str, expected: &[TokenType], span: Span) {
        let expected: Vec<&str> = expected.iter().map(|kind| kind.as_str()).collect();
        self.fail(
            actual,
            span,
            format!("expected here: {}", expected.join(" or ")),
        );
    }

    fn emit_parse_int_error(&mut self, value: &str, _: std::num::ParseIntError, span: Span) {
        self.fail(
            value,
            span,
            "a line or program number is a whole number below 2^32".to_owned(),
        );
    }
}

impl ProgramVisitor for Reader<'_> {
    fn start_block(&mut self) -> ControlFlow<impl BlockVisitor + '_> {
        ControlFlow::Continue(Part {
            reader: self,
            code: None,
        })
    }
}

/// A block, or a command with its arguments.
struct Part<'r, 's> {
    reader: &'r mut Reader<'s>,
    /// Index of the command's code among the words.
    code: Option<usize>,
}

impl<'s> Part<'_, 's> {
    fn command(&mut self, letter: char, number: Number) -> ControlFlow<Part<'_, 's>> {
        let code = Some(self.reader.words.len());
        self.reader.code(letter, number);
        ControlFlow::Continue(Part {
            reader: self.reader,
            code,
        })
    }
}

impl Diagnostics for Part<'_, '_> {
    fn emit_unknown_content(&mut self, text: &str, span: Span) {
        self.reader.emit_unknown_content(text, span);
    }

    fn emit_unexpected(&mut self, actual: &str, expected: &[TokenType], span: Span) {
        self.reader.emit_unexpected(actual, expected, span);
    }

    fn emit_parse_int_error(&mut self, value: &str, error: std::num::ParseIntError, span: Span) {
        self.reader.emit_parse_int_error(value, error, span);
    }
}

impl BlockVisitor for Part<'_, '_> {
    fn comment(&mut self, value: &str, span: Span) {
        // An open comment would swallow the rest of the program.
        if value.starts_with('(') && (!value.ends_with(')') || value.contains('\n')) {
            let line = value.lines().next().unwrap_or_default();
            self.reader.fail(
                line,
                span,
                "the comment is not closed in its line".to_owned(),
            );
        }
    }

    fn word_address(&mut self, letter: char, _: Value<'_>, span: Span) {
        self.reader.word(letter, span);
    }

    fn start_general_code(&mut self, number: Number) -> ControlFlow<impl CommandVisitor + '_> {
        self.command('G', number)
    }

    fn start_miscellaneous_code(
        &mut self,
        number: Number,
    ) -> ControlFlow<impl CommandVisitor + '_> {
        self.command('M', number)
    }

    fn start_tool_change_code(&mut self, number: Number) -> ControlFlow<impl CommandVisitor + '_> {
        self.command('T', number)
    }
}

impl CommandVisitor for Part<'_, '_> {
    fn argument(&mut self, letter: char, _: Value<'_>, span: Span) {
        self.reader.word(letter, span);
    }

    fn end_command(self, span: Span) {
        if let Some(code) = self.code.and_then(|index| self.reader.words.get_mut(index)) {
            code.line = span.line + 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(source: &str) -> Vec<(String, usize)> {
        let words = words(source).unwrap();
        words
            .into_iter()
            .map(|word| (word.text, word.line))
            .collect()
    }

    #[test]
    fn words_come_with_their_lines_and_without_comments() {
        let source = "%\nO100 (a G9999999999 program)\nN10 g21 G90.1\nG1x-1.5 Y + 2 F300 ; feed\n\nX.5\nM30\n%\n";
        let expected = [
            ("G21", 3),
            ("G90.1", 3),
            ("G1", 4),
            ("x-1.5", 4),
            ("Y+2", 4),
            ("F300", 4),
            ("X.5", 6),
            ("M30", 7),
        ];
        assert_eq!(
            texts(source),
            expected.map(|(text, line)| (text.to_owned(), line))
        );
    }

    #[test]
    fn numbers_are_read_in_full() {
        let words = words("G1 X123.456789012 F1").unwrap();
        assert_eq!(words[1].value, 123.456_789_012);
    }

    #[test]
    fn what_is_no_g_code_is_refused_with_its_line() {
        for (source, line) in [
            ("G21\nG1 X", 2),
            ("G1 X1 #5", 1),
            ("hello", 1),
            ("\n\nG1 (open\nX5 F1", 3),
            ("G91.12", 1),
            ("X1\nG91. X5", 2),
            ("G99999999999 X1", 1),
            ("N99999999999 G1", 1),
            ("/G1 X1", 1),
            ("G1 X1 = 2", 1),
            ("G1 X1\nX99999999999", 2),
            ("G\nX1", 1),
        ] {
            match words(source) {
                Err(ProgramError::Syntax { line: found, .. }) => {
                    assert_eq!(found, line, "{source}")
                }
                other => panic!("{source:?} gives {other:?}"),
            }
        }
    }
}
