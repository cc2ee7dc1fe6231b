//! Tokens of Rust source: words, signs, text literals, doc comments. Other comments and all numbers are dropped.

/// The kind of a token.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// An identifier or keyword.
    Word,
    /// One character of punctuation, or `::`.
    Sign,
    /// The contents of a string literal.
    Literal,
    /// One line of a doc comment on what follows, `///`.
    OuterDoc,
    /// One line of a doc comment on what encloses it, `//!`.
    InnerDoc,
}

/// A token.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Token<'a> {
    pub(crate) kind: Kind,
    pub(crate) text: &'a str,
    /// Its line, from 1.
    pub(crate) line: usize,
}

impl Token<'_> {
    pub(crate) fn is_word(&self, text: &str) -> bool {
        self.kind == Kind::Word && self.text == text
    }

    pub(crate) fn is_sign(&self, text: &str) -> bool {
        self.kind == Kind::Sign && self.text == text
    }
}

/// Splits a source into its tokens.
pub(crate) fn tokens(source: &str) -> Vec<Token<'_>> {
    let bytes = source.as_bytes();
    let mut found = Vec::new();
    let (mut at, mut line) = (0, 1);
    while at < bytes.len() {
        let rest = &source[at..];
        let (length, token) = next(rest);
        if let Some((kind, from, to)) = token {
            let text = &rest[from..to];
            found.push(Token { kind, text, line });
        }
        line += rest.as_bytes()[..length]
            .iter()
            .filter(|&&byte| byte == b'\n')
            .count();
        at += length;
    }
    found
}

/// Length of what comes next, and its kind and text if it is a token.
fn next(rest: &str) -> (usize, Option<(Kind, usize, usize)>) {
    let first = rest.chars().next().unwrap_or(' ');
    if rest.starts_with("//") {
        let end = rest.find('\n').unwrap_or(rest.len());
        let kind = match rest.as_bytes().get(2) {
            Some(b'!') => Some(Kind::InnerDoc),
            Some(b'/') if !rest.starts_with("////") => Some(Kind::OuterDoc),
            _ => None,
        };
        return (end, kind.map(|kind| (kind, 3, end)));
    }
    if rest.starts_with("/*") {
        return (block_comment(rest), None);
    }
    if let Some((open, hashes)) = raw_string(rest) {
        let close = format!("\"{}", "#".repeat(hashes));
        let end = rest[open..]
            .find(&close)
            .map_or(rest.len(), |end| open + end);
        let length = (end + close.len()).min(rest.len());
        return (length, Some((Kind::Literal, open, end)));
    }
    if first == '"' || rest.starts_with("b\"") || rest.starts_with("c\"") {
        let open = rest.find('"').unwrap_or(0) + 1;
        let end = quoted(rest, open, '"');
        let length = (end + 1).min(rest.len());
        return (length, Some((Kind::Literal, open, end)));
    }
    if first == '\'' {
        return (character_or_lifetime(rest), None);
    }
    if first.is_alphanumeric() || first == '_' {
        let end = rest
            .find(|c: char| !c.is_alphanumeric() && c != '_')
            .unwrap_or(rest.len());
        let word = !first.is_numeric();
        return (end, word.then_some((Kind::Word, 0, end)));
    }
    if rest.starts_with("::") {
        return (2, Some((Kind::Sign, 0, 2)));
    }
    let length = first.len_utf8();
    let sign = !first.is_whitespace();
    (length, sign.then_some((Kind::Sign, 0, length)))
}

fn block_comment(rest: &str) -> usize {
    let (mut depth, mut at) = (0, 0);
    while at < rest.len() {
        let here = &rest.as_bytes()[at..];
        if here.starts_with(b"/*") {
            depth += 1;
            at += 2;
        } else if here.starts_with(b"*/") {
            depth -= 1;
            at += 2;
            if depth == 0 {
                return at;
            }
        } else {
            at += 1;
        }
    }
    rest.len()
}

/// Returns the beginning of a raw string's text, and its number of hashes.
fn raw_string(rest: &str) -> Option<(usize, usize)> {
    let after = ["r", "br", "cr"]
        .iter()
        .find_map(|prefix| rest.strip_prefix(prefix))?;
    let hashes = after.bytes().take_while(|&byte| byte == b'#').count();
    let open = rest.len() - after.len() + hashes;
    (rest.as_bytes().get(open) == Some(&b'"')).then_some((open + 1, hashes))
}

/// Returns the end of a quoted text that begins at `open`.
fn quoted(rest: &str, open: usize, quote: char) -> usize {
    let mut escaped = false;
    for (at, character) in rest[open..].char_indices() {
        match character {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            _ if character == quote => return open + at,
            _ => {}
        }
    }
    rest.len()
}

fn character_or_lifetime(rest: &str) -> usize {
    let mut characters = rest[1..].char_indices();
    match (characters.next(), characters.next()) {
        (Some((_, '\\')), _) => (quoted(rest, 1, '\'') + 1).min(rest.len()),
        (Some(_), Some((at, '\''))) => at + 2,
        _ => 1,
    }
}

#[test]
fn comments_literals_and_lifetimes_are_distinguished() {
    let source = "/// doc\nfn f<'a>(c: &'a str) { g('\"', \"un\\\"safe\", r#\"a\"b\"#); } // unsafe\n/* unsafe */";
    let words = |kind| -> Vec<_> {
        tokens(source)
            .iter()
            .filter(|token| token.kind == kind)
            .map(|token| token.text)
            .collect()
    };
    assert_eq!(words(Kind::Word), ["fn", "f", "a", "c", "a", "str", "g"]);
    assert_eq!(words(Kind::Literal), ["un\\\"safe", "a\"b"]);
    assert_eq!(words(Kind::OuterDoc), [" doc"]);
}
