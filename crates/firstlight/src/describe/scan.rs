//! Looking through a text before the parsers do.
//!
//! Both parsers come from outside and were written for friendly input: their recursion, and the recursive drop of what
//! they build, would overflow the stack, and a token takes many times the memory of its letters. Nesting, tokens and
//! tables are therefore counted here, one expression after another, and what goes beyond a limit never reaches them.
//! Nor do long lists of numbers: a list of millions of positions is left as it stands in the text ([`Numbers`]), and
//! read from there.

use std::borrow::Cow;
use std::collections::HashMap;

use super::node::{Span, Syntax, SyntaxFault};

/// Largest nesting of arrays and tables.
pub(super) const MAX_DEPTH: usize = 64;
/// Most words, numbers and punctuation marks in one text, without those of long lists of numbers.
const MAX_TOKENS: usize = 1 << 24;
/// Most tables in one text: each takes about 250 bytes.
const MAX_TABLES: usize = 1 << 21;
/// Most tables in one expression of TOML: the parser takes more than 1,000 bytes for each.
const MAX_INLINE_TABLES: usize = 1 << 18;
/// Lists of so many numbers are left in the text.
const LONG: u32 = 64;

/// A long list of numbers, or of lists of as many numbers each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Numbers {
    /// Elements of the list.
    pub count: u32,
    /// Numbers of each element, where these are lists.
    pub width: Option<u32>,
}

/// A key and its value, the header of a table, or something in between; of JSON the whole text.
#[derive(Debug, Default)]
pub(super) struct Expression {
    pub range: Span,
    pub is_header: bool,
    /// The long lists in it, brackets included.
    pub lists: Vec<(Span, Numbers)>,
}

/// A piece of the text as the parser sees it: long lists of numbers are empty.
pub(super) struct TextPiece<'t> {
    pub text: Cow<'t, str>,
    /// Where its text starts, or goes on after a list: there, and in the whole text.
    starts: Vec<[usize; 2]>,
    /// The lists, by where they start in the whole text.
    lists: HashMap<usize, Numbers>,
}

impl<'t> TextPiece<'t> {
    pub fn new(text: &'t str, expression: &Expression) -> Self {
        let mut piece = TextPiece { text: Cow::Borrowed(""), starts: Vec::new(), lists: HashMap::new() };
        let mut start = expression.range.start;
        for (list, numbers) in &expression.lists {
            piece.starts.push([piece.text.len(), start]);
            piece.text += &text[start..=list.start];
            piece.lists.insert(list.start, *numbers);
            start = list.end - 1;
        }
        piece.starts.push([piece.text.len(), start]);
        piece.text += &text[start..expression.range.end];
        piece
    }

    /// A range of this text as one of the whole.
    pub fn span(&self, range: std::ops::Range<usize>) -> Span {
        let whole = |at: usize| {
            let after = self.starts.partition_point(|[here, _]| *here <= at);
            let [here, there] = self.starts[after.max(1) - 1];
            there + (at - here)
        };
        let start = whole(range.start);
        // The end is that of the last byte
        let end = if range.end > range.start { whole(range.end - 1) + 1 } else { start };
        Span { start, end }
    }

    /// The list that was left out there.
    pub fn list_at(&self, span: Span) -> Option<Numbers> {
        self.lists.get(&span.start).copied()
    }
}

/// Goes through a text, expression by expression.
pub(super) struct Scan<'t> {
    text: &'t str,
    syntax: Syntax,
    at: usize,
    tokens: usize,
    tables: usize,
}

impl<'t> Scan<'t> {
    pub fn new(text: &'t str, syntax: Syntax) -> Self {
        Scan { text, syntax, at: 0, tokens: 0, tables: 0 }
    }

    /// The next expression, with the end of its line; `None` at the end of the text.
    pub fn next(&mut self) -> Result<Option<Expression>, SyntaxFault> {
        let bytes = self.text.as_bytes();
        let is_toml = self.syntax == Syntax::Toml;
        if self.at == bytes.len() {
            return Ok(None);
        }
        let first = bytes[self.at..].iter().find(|byte| !matches!(byte, b' ' | b'\t'));
        let is_header = is_toml && first == Some(&b'[');
        let mut found = Expression { range: Span { start: self.at, end: 0 }, is_header, lists: Vec::new() };
        let tables_before = self.tables;
        // Depth at each open bracket; a dotted key `a.b.c` nests like a table in a table in a table
        let mut open: Vec<usize> = Vec::new();
        let (mut depth, mut dots, mut key_dots) = (0, 0, 0);
        let mut in_word = false;
        let mut i = self.at;
        while i < bytes.len() {
            let at = i;
            let byte = bytes[i];
            i += 1;
            let is_word = byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'-' | b'+') || byte >= 0x80;
            if !(is_word && in_word) {
                self.tokens += 1;
            }
            in_word = is_word;
            match byte {
                b'"' | b'\'' if byte == b'"' || is_toml => i = string_end(bytes, at, self.syntax),
                b'#' if is_toml => i = line_end(bytes, at),
                b'[' | b'{' => {
                    if byte == b'['
                        && !is_header
                        && let Some((end, numbers)) = numbers_at(bytes, at, self.syntax)
                    {
                        found.lists.push((Span { start: at, end }, numbers));
                        i = end;
                        continue;
                    }
                    self.tables += usize::from(byte == b'{' || is_header && open.is_empty());
                    open.push(depth);
                    depth += 1 + key_dots;
                    (dots, key_dots) = (0, 0);
                    if depth > MAX_DEPTH {
                        return Err(too_deep(at));
                    }
                }
                b']' | b'}' => {
                    depth = open.pop().unwrap_or(0);
                    self.tables += if is_header { dots } else { 0 };
                    (dots, key_dots) = (0, 0);
                }
                b'=' => {
                    self.tables += dots;
                    (dots, key_dots) = (0, dots);
                }
                b'\n' if is_toml && open.is_empty() => break,
                b',' | b'\n' | b':' => (dots, key_dots) = (0, 0),
                b'.' => {
                    dots += 1;
                    if depth + dots > MAX_DEPTH {
                        return Err(too_deep(at));
                    }
                }
                // JSON takes it for a blank
                b'\r' if is_toml && bytes.get(i) != Some(&b'\n') => {
                    let message = "not TOML: a carriage return without a newline".to_owned();
                    let hint = "save the text with lines that end in a newline (LF, or CR LF)";
                    return Err(SyntaxFault::new(Span { start: at, end: i }, message, Some(hint)));
                }
                _ => {}
            }
            if self.tokens > MAX_TOKENS || self.tables > MAX_TABLES {
                let (most, what) = if self.tables > MAX_TABLES {
                    (MAX_TABLES, "tables")
                } else {
                    (MAX_TOKENS, "words, numbers and marks")
                };
                let hint = "spread the scene over several files with `include`; a mesh or point set of many parts is \
                            best a file of its own";
                let message = format!("more than {most} {what} in one text");
                return Err(SyntaxFault::new(Span { start: at, end: at + 1 }, message, Some(hint)));
            }
            if is_toml && self.tables - tables_before > MAX_INLINE_TABLES {
                let message = format!("more than {MAX_INLINE_TABLES} tables in one value");
                let hint = "write each under a header of its own, as [[sphere]]";
                return Err(SyntaxFault::new(Span { start: at, end: at + 1 }, message, Some(hint)));
            }
        }
        self.at = i;
        found.range.end = i;
        Ok(Some(found))
    }
}

fn too_deep(at: usize) -> SyntaxFault {
    let message = format!("more than {MAX_DEPTH} tables or arrays within each other");
    SyntaxFault::new(Span { start: at, end: at + 1 }, message, Some("a scene needs no more than 5"))
}

/// Where the line ends.
fn line_end(bytes: &[u8], at: usize) -> usize {
    bytes[at..].iter().position(|byte| *byte == b'\n').map_or(bytes.len(), |length| at + length)
}

/// The byte after the string that starts at `start`; where it is never closed, the end of the line or of the text.
fn string_end(bytes: &[u8], start: usize, syntax: Syntax) -> usize {
    let quote = bytes[start];
    let long = syntax == Syntax::Toml && bytes[start..].starts_with(&[quote; 3]);
    let escapes = quote == b'"';
    let mut i = if long { start + 3 } else { start + 1 };
    while i < bytes.len() {
        match bytes[i] {
            b'\\' if escapes => i += 1,
            b'\n' if !long => return i,
            byte if byte == quote && !long => return i + 1,
            byte if byte == quote && bytes[i..].starts_with(&[quote; 3]) => {
                // Up to two quotes may stand before the three that close it
                while bytes.get(i) == Some(&quote) {
                    i += 1;
                }
                return i;
            }
            _ => {}
        }
        i += 1;
    }
    bytes.len()
}

/// The long list of numbers that starts at the bracket at `start`, and where it ends. `None` where anything else stands
/// there: the parsers will say what it is.
fn numbers_at(bytes: &[u8], start: usize, syntax: Syntax) -> Option<(usize, Numbers)> {
    let nested = bytes.get(skip(bytes, start + 1, syntax)) == Some(&b'[');
    let list = |start: usize, element: &mut dyn FnMut(usize) -> Option<usize>| -> Option<(usize, u32)> {
        let (mut at, mut count) = (start + 1, 0u32);
        loop {
            at = skip(bytes, at, syntax);
            // TOML takes a comma before the end
            if bytes.get(at) == Some(&b']') && syntax == Syntax::Toml && count > 0 {
                return Some((at + 1, count));
            }
            at = skip(bytes, element(at)?, syntax);
            count += 1;
            match bytes.get(at)? {
                b',' => at += 1,
                b']' => return Some((at + 1, count)),
                _ => return None,
            }
        }
    };
    let number = &mut |at: usize| number_end(bytes, at);
    if !nested {
        let (end, count) = list(start, number)?;
        return (count >= LONG).then_some((end, Numbers { count, width: None }));
    }
    let mut width = None;
    let row = &mut |at: usize| {
        let (end, count) = if bytes.get(at) == Some(&b'[') { list(at, number)? } else { return None };
        (*width.get_or_insert(count) == count).then_some(end)
    };
    let (end, count) = list(start, row)?;
    let width = width?;
    (u64::from(count) * u64::from(width) >= u64::from(LONG)).then_some((end, Numbers { count, width: Some(width) }))
}

/// After blanks, line ends and comments.
fn skip(bytes: &[u8], mut at: usize, syntax: Syntax) -> usize {
    loop {
        match bytes.get(at) {
            Some(b' ' | b'\t' | b'\n') => at += 1,
            Some(b'\r') if bytes.get(at + 1) == Some(&b'\n') => at += 2,
            Some(b'#') if syntax == Syntax::Toml && is_clean_comment(bytes, at) => at = line_end(bytes, at),
            _ => return at,
        }
    }
}

/// Whether TOML has nothing against a comment.
fn is_clean_comment(bytes: &[u8], at: usize) -> bool {
    let line = &bytes[at..line_end(bytes, at)];
    line.strip_suffix(b"\r").unwrap_or(line).iter().all(|byte| matches!(byte, b'\t' | b' '..=b'~'))
}

/// The end of a number as JSON writes it, and TOML too.
fn number_end(bytes: &[u8], start: usize) -> Option<usize> {
    let digits = |at: usize| at + bytes[at..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    let whole = start + usize::from(bytes.get(start) == Some(&b'-'));
    let mut end = digits(whole);
    if end == whole || bytes[whole] == b'0' && end > whole + 1 {
        return None;
    }
    if bytes.get(end) == Some(&b'.') {
        let fraction = end + 1;
        end = digits(fraction);
        if end == fraction {
            return None;
        }
    }
    if let Some(b'e' | b'E') = bytes.get(end) {
        let exponent = end + 1 + usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        end = digits(exponent);
        if end == exponent {
            return None;
        }
    }
    Some(end)
}

impl Numbers {
    /// The elements of the list whose text is at `span`: where each stands, and its number, unless it is a list.
    pub fn elements(self, text: &str, span: Span) -> impl Iterator<Item = (Span, Option<f64>)> + '_ {
        let bytes = text.as_bytes();
        let mut at = span.start + 1;
        (0..self.count).map_while(move |_| {
            // Comments are of TOML; in JSON there are none
            at = skip(bytes, at, Syntax::Toml);
            let start = at;
            let end = match self.width {
                Some(width) => row_end(bytes, start, width)?,
                None => number_end(bytes, start)?,
            };
            at = skip(bytes, end, Syntax::Toml);
            at += usize::from(bytes.get(at) == Some(&b','));
            let number = self.width.is_none().then(|| value(text.get(start..end).unwrap_or_default()));
            Some((Span { start, end }, number))
        })
    }
}

/// The end of a list of `width` numbers.
fn row_end(bytes: &[u8], start: usize, width: u32) -> Option<usize> {
    let mut at = start + 1;
    for _ in 0..width {
        at = skip(bytes, number_end(bytes, skip(bytes, at, Syntax::Toml))?, Syntax::Toml);
        at += usize::from(bytes.get(at) == Some(&b','));
    }
    at = skip(bytes, at, Syntax::Toml);
    (bytes.get(at) == Some(&b']')).then_some(at + 1)
}

/// The number of digits that [`number_end`] accepts.
fn value(digits: &str) -> f64 {
    let number = digits.parse().unwrap_or(f64::NAN);
    // Of whole numbers there is one 0
    if digits.contains(['.', 'e', 'E']) { number } else { number + 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lists(text: &str, syntax: Syntax) -> Vec<(Span, Numbers)> {
        let mut scan = Scan::new(text, syntax);
        let mut all = Vec::new();
        while let Some(expression) = scan.next().expect("is within the limits") {
            all.extend(expression.lists);
        }
        all
    }

    #[test]
    fn long_lists_of_numbers_are_found_and_read() {
        let numbers: Vec<f64> = (0..300).map(|i| f64::from(i - 150) * 0.25).collect();
        let flat = format!("a = [ {} ]", numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ,\t"));
        let rows: Vec<String> =
            numbers.chunks(3).map(|row| format!("[{}, {:e},{} ]", row[0], row[1], row[2])).collect();
        let nested = format!("a = [ # the first\n{}, # [1]\r\n]\n", rows.join(",\r\n"));
        let (found, of) = lists(&flat, Syntax::Toml)[0];
        assert_eq!((of, &flat[found.start..=found.start]), (Numbers { count: 300, width: None }, "["));
        let read: Vec<f64> = of.elements(&flat, found).filter_map(|(_, number)| number).collect();
        assert_eq!(read, numbers);
        let (found, of) = lists(&nested, Syntax::Toml)[0];
        assert_eq!(of, Numbers { count: 100, width: Some(3) });
        assert_eq!(&nested[found.end - 3..found.end + 1], "\r\n]\n");
        let row = Numbers { count: 3, width: None };
        let read: Vec<f64> = of
            .elements(&nested, found)
            .flat_map(|(span, _)| row.elements(&nested, span).filter_map(|(_, number)| number).collect::<Vec<_>>())
            .collect();
        assert_eq!(read, numbers);
        let json = format!("{{\"a\": [{}]}}", vec!["-1.5e2"; 64].join(","));
        assert_eq!(lists(&json, Syntax::Json).len(), 1);
    }

    #[test]
    fn what_is_not_plainly_a_list_of_numbers_is_left_to_the_parsers() {
        let many = |element: &str| vec![element; 100].join(",");
        for element in
            ["1.", ".5", "01", "+1", "0x1", "1_0", "inf", "nan", "1e", "\"1\"", "[1]", "[]", "1 2", "--1", "1979-05-27"]
        {
            // The last of them is different, which is seen late
            assert_eq!(lists(&format!("a = [{},{element}]", many("1")), Syntax::Toml), [], "{element}");
        }
        for text in [many("1"), format!("[{}", many("1")), format!("[{}}}", many("1")), format!("[{},,]", many("1"))] {
            assert_eq!(lists(&format!("a = {text}"), Syntax::Toml), [], "{text}");
        }
        assert_eq!(lists(&format!("[{},]", many("1")), Syntax::Json), []);
        assert_eq!(lists(&format!("a = [{},]", many("1")), Syntax::Toml).len(), 1);
        // Rows of different lengths, short lists, headers
        assert_eq!(lists(&format!("a = [{},[1,2,3]]", many("[1,2]")), Syntax::Toml), []);
        assert_eq!(lists(&format!("a = [{},]", vec!["1"; 63].join(",")), Syntax::Toml), []);
        assert_eq!(lists(&format!("[[{}]]", vec!["1"; 70].join(",")), Syntax::Toml), []);
    }

    #[test]
    fn expressions_end_with_their_lines() {
        let text = "a = 1 # [\n\n[b]\r\nc = [1,\n2]\nd = \"\"\"\n[\n\"\"\"\n";
        let mut scan = Scan::new(text, Syntax::Toml);
        let mut all = Vec::new();
        while let Some(Expression { range, is_header, .. }) = scan.next().expect("is within the limits") {
            all.push((&text[range.start..range.end], is_header));
        }
        let expected = [
            ("a = 1 # [\n", false),
            ("\n", false),
            ("[b]\r\n", true),
            ("c = [1,\n2]\n", false),
            ("d = \"\"\"\n[\n\"\"\"\n", false),
        ];
        assert_eq!(all, expected);
    }
}
