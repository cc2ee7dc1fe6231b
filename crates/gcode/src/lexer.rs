//! From text to words, as RS274/NGC writes them.

use crate::error::ProgramError;

/// A letter with its number.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Word {
    /// In upper case.
    pub(super) letter: char,
    pub(super) value: f64,
    /// As it is written, without spaces.
    pub(super) text: String,
    /// Its line, from 1.
    pub(super) line: usize,
}

/// Content of a line.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Line {
    /// Its words, without comments and line numbers; there may be none.
    Words(Vec<Word>),
    /// A line that a slash marks to be left out.
    Deleted,
    /// A percent sign, which begins and ends a program.
    Percent,
}

/// Largest magnitude of a number other than a feed: beyond every machine's travel, in any unit.
const LARGEST: f64 = 1e6;

const PARAMETERS: &str = "parameters (#)";
const EXPRESSIONS: &str = "expressions ([ ])";
const O_WORDS: &str = "subprograms and loops (O-words)";

/// The lines of a text: each ends with a line feed, a carriage return, or both.
pub(super) fn lines(source: &str) -> impl Iterator<Item = &str> {
    let mut rest = Some(source.trim_start_matches('\u{feff}'));
    std::iter::from_fn(move || {
        let text = rest?;
        let Some(end) = text.find(['\r', '\n']) else {
            return rest.take();
        };
        let both = text[end..].starts_with("\r\n");
        rest = Some(&text[end + 1 + usize::from(both)..]);
        Some(&text[..end])
    })
}

/// Reads a line; `number` counts from 1.
///
/// # Errors
/// Text that is no G-code, or a part of the language that is not supported.
pub(super) fn line(text: &str, number: usize) -> Result<Line, ProgramError> {
    let code = without_comments(text, number)?;
    if code.starts_with('%') {
        return Ok(Line::Percent);
    }
    if code.starts_with('/') {
        return Ok(Line::Deleted);
    }
    let mut reader = Reader {
        code: &code,
        number,
    };
    let mut words = Vec::new();
    while let Some(word) = reader.word(words.is_empty())? {
        if !matches!(word.letter, 'N' | 'O') {
            words.push(word);
        }
    }
    Ok(Line::Words(words))
}

/// A line without spaces, control characters and what stands in parentheses or after a semicolon.
fn without_comments(text: &str, number: usize) -> Result<String, ProgramError> {
    let mut depth = 0_usize;
    let mut code = String::new();
    for character in text.chars() {
        match (character, depth) {
            ('(', _) => depth += 1,
            (')', 1..) => depth -= 1,
            (';', 0) => break,
            (_, 0) if !(character.is_whitespace() || character.is_control()) => {
                code.push(character);
            }
            _ => {}
        }
    }
    if depth == 0 {
        return Ok(code);
    }
    Err(ProgramError::Syntax {
        line: number,
        text: text.trim().to_owned(),
        detail: "the comment is not closed in its line".to_owned(),
    })
}

/// The rest of a line.
struct Reader<'t> {
    code: &'t str,
    number: usize,
}

impl Reader<'_> {
    /// Takes the next word; nothing at the line's end.
    fn word(&mut self, first: bool) -> Result<Option<Word>, ProgramError> {
        let Some(letter) = self.code.chars().next() else {
            return Ok(None);
        };
        // A colon begins a program's number as O does.
        let letter = match letter.to_ascii_uppercase() {
            ':' if first => 'O',
            letter => letter,
        };
        match letter {
            'A'..='Z' => {}
            '#' => return Err(self.unsupported(self.code, PARAMETERS)),
            '[' => return Err(self.unsupported(self.code, EXPRESSIONS)),
            _ => return Err(self.syntax(self.code, "it is no word of G-code")),
        }
        let rest = &self.code[1..];
        let signed = usize::from(rest.starts_with(['+', '-']));
        let length = rest[signed..]
            .find(|sign: char| !(sign.is_ascii_digit() || sign == '.'))
            .map_or(rest.len(), |end| signed + end);
        let (text, after) = self.code.split_at(1 + length);
        let value = text[1..]
            .parse()
            .ok()
            .filter(|value: &f64| value.is_finite());
        if letter == 'O' {
            let keyword = after
                .starts_with(|sign: char| sign.is_ascii_alphabetic() && !"GMTNgmtn".contains(sign));
            if value.is_none() || keyword {
                return Err(self.unsupported(self.code, O_WORDS));
            }
        }
        let Some(value) = value else {
            return Err(if after.starts_with('#') {
                self.unsupported(self.code, PARAMETERS)
            } else if self.code.contains('[') {
                self.unsupported(self.code, EXPRESSIONS)
            } else {
                self.syntax(text, "a number should follow the letter")
            });
        };
        if after.starts_with(',') {
            return Err(self.syntax(self.code, "a number has a decimal point, no comma"));
        }
        self.check(letter, text, value)?;
        self.code = after;
        Ok(Some(Word {
            letter,
            value,
            text: text.to_owned(),
            line: self.number,
        }))
    }

    /// Refuses numbers that the letter does not take.
    fn check(&self, letter: char, text: &str, value: f64) -> Result<(), ProgramError> {
        let code = matches!(letter, 'G' | 'M' | 'T');
        let decimals = text.split_once('.').map(|(_, decimals)| decimals.len());
        if code && (value < 0.0 || decimals.is_some_and(|count| count != 1)) {
            return Err(self.syntax(text, "a code is a whole number, or has one decimal"));
        }
        // A line's number counts nothing, and a feed ends at what the axes can do.
        if !matches!(letter, 'N' | 'O' | 'F') && value.abs() > LARGEST {
            return Err(self.syntax(text, &format!("its number is beyond {LARGEST}")));
        }
        Ok(())
    }

    fn syntax(&self, text: &str, detail: &str) -> ProgramError {
        ProgramError::Syntax {
            line: self.number,
            text: text.to_owned(),
            detail: detail.to_owned(),
        }
    }

    fn unsupported(&self, text: &str, what: &'static str) -> ProgramError {
        ProgramError::NotRead {
            line: self.number,
            text: text.to_owned(),
            what,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The words of a text with their lines.
    fn texts(source: &str) -> Result<Vec<(String, usize)>, ProgramError> {
        let mut texts = Vec::new();
        for (index, text) in lines(source).enumerate() {
            if let Line::Words(words) = line(text, index + 1)? {
                texts.extend(words.into_iter().map(|word| (word.text, word.line)));
            }
        }
        Ok(texts)
    }

    #[test]
    fn words_come_with_their_lines_and_without_comments() {
        let source = "%\nO100 (a G9999999999 program)\nN10 g21 G90.1\nG1x-1.5 Y + 2 F300 ; feed\n\nX.5\nN20000000000 M30\n%\n";
        let expected = [
            ("g21", 3),
            ("G90.1", 3),
            ("G1", 4),
            ("x-1.5", 4),
            ("Y+2", 4),
            ("F300", 4),
            ("X.5", 6),
            ("M30", 7),
        ];
        assert_eq!(
            texts(source).unwrap(),
            expected.map(|(text, line)| (text.to_owned(), line))
        );
    }

    #[test]
    fn a_carriage_return_ends_a_line_as_a_line_feed_does() {
        for end in ["\n", "\r", "\r\n"] {
            let source = ["G1", "; a comment", "", "X5 (two)", "Y6"].join(end);
            let expected = [("G1", 1), ("X5", 4), ("Y6", 5)];
            let expected = expected.map(|(text, line)| (text.to_owned(), line));
            assert_eq!(texts(&source).unwrap(), expected, "{end:?}");
        }
    }

    #[test]
    fn numbers_are_read_in_full() {
        let Line::Words(words) = line("G1 X123.456789012 F1", 1).unwrap() else {
            panic!("no words");
        };
        assert_eq!(words[1].value, 123.456_789_012);
    }

    #[test]
    fn what_is_no_g_code_is_refused_with_its_line() {
        for (source, line) in [
            ("G21\nG1 X", 2),
            ("hello", 1),
            ("\n\nG1 (open\nX5 F1", 3),
            ("G91.12", 1),
            ("X1\nG91. X5", 2),
            ("G99999999999 X1", 1),
            ("G-1 X1", 1),
            ("G1 X1 = 2", 1),
            ("G1 X1\nX99999999999", 2),
            ("G1 X1,5", 1),
            ("G1 X1.2.3", 1),
            ("G1 X1 % 5", 1),
            ("G1 X1 /Y5", 1),
            ("G1 é", 1),
            ("G\nX1", 1),
        ] {
            match texts(source) {
                Err(ProgramError::Syntax { line: found, .. }) => {
                    assert_eq!(found, line, "{source}")
                }
                other => panic!("{source:?} gives {other:?}"),
            }
        }
    }

    #[test]
    fn a_language_within_the_language_is_refused_by_its_name() {
        for (source, name) in [
            ("G1 X1 #5", PARAMETERS),
            ("#1=5", PARAMETERS),
            ("#<depth> = 2", PARAMETERS),
            ("G1 X#1", PARAMETERS),
            ("G1 X-#<depth>", PARAMETERS),
            ("G1 X[1+2]", EXPRESSIONS),
            ("G1 X-[1+2]", EXPRESSIONS),
            ("G1 Xsin[30]", EXPRESSIONS),
            ("o100 sub", O_WORDS),
            ("O<pocket> call [5]", O_WORDS),
            ("N5 o100 while [#1 lt 5]", O_WORDS),
            ("o100 endif", O_WORDS),
            ("o100 repeat [5]", O_WORDS),
        ] {
            match texts(source) {
                Err(ProgramError::NotRead { what, .. }) => assert_eq!(what, name, "{source}"),
                other => panic!("{source:?} gives {other:?}"),
            }
        }
    }
}
