//! Words and numbers of text files, and how large files are cut for all threads.
//!
//! Numbers are correctly rounded. The common ones, of up to 19 digits and a small power of ten, are one multiplication
//! or division of two exact f64 (W. D. Clinger 1990, "How to read floating point numbers accurately"); the standard
//! library reads the others.

use std::ops::Range;

/// Bytes that part words on a line.
#[inline(always)]
pub(super) fn is_blank(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | 0x0b | 0x0c)
}

/// Bytes that end a line: LF, CR LF, CR.
#[inline(always)]
pub(super) fn is_line_end(byte: u8) -> bool {
    byte == b'\n' || byte == b'\r'
}

/// A place in text, moving forward.
#[derive(Clone)]
pub(super) struct Cursor<'a> {
    /// The file, up to where reading shall end.
    pub(super) bytes: &'a [u8],
    /// The next byte.
    pub(super) at: usize,
}

impl<'a> Cursor<'a> {
    #[inline(always)]
    pub(super) fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    #[inline(always)]
    pub(super) fn at_end(&self) -> bool {
        self.at >= self.bytes.len()
    }

    /// Whether the line, or the text, ends here.
    #[inline(always)]
    pub(super) fn at_line_end(&self) -> bool {
        self.peek().is_none_or(is_line_end)
    }

    #[inline(always)]
    pub(super) fn skip_blanks(&mut self) {
        while self.peek().is_some_and(is_blank) {
            self.at += 1;
        }
    }

    /// Skips blanks and line ends.
    #[inline(always)]
    pub(super) fn skip_space(&mut self) {
        while self.peek().is_some_and(|b| is_blank(b) || is_line_end(b)) {
            self.at += 1;
        }
    }

    /// Goes past the line end that is here.
    #[inline(always)]
    pub(super) fn pass_line_end(&mut self) {
        match self.peek() {
            Some(b'\r') => self.at += 1 + usize::from(self.bytes.get(self.at + 1) == Some(&b'\n')),
            Some(_) => self.at += 1,
            None => {}
        }
    }

    /// The rest of the line, without its end; stands before that end afterwards.
    pub(super) fn rest_of_line(&mut self) -> &'a [u8] {
        let start = self.at;
        while !self.at_line_end() {
            self.at += 1;
        }
        &self.bytes[start..self.at]
    }

    /// The word that begins here; empty where none does.
    #[inline(always)]
    pub(super) fn word(&mut self) -> &'a [u8] {
        let start = self.at;
        while self.peek().is_some_and(|b| !is_blank(b) && !is_line_end(b)) {
            self.at += 1;
        }
        &self.bytes[start..self.at]
    }

    /// The word that begins here, without going past it: for messages.
    pub(super) fn next_word(&self) -> &'a [u8] {
        self.clone().word()
    }

    /// The number that begins here, rounded to f32; `None`, and no step forward, if none does.
    #[inline(always)]
    pub(super) fn f32(&mut self) -> Option<f32> {
        if let Some(decimal) = Decimal::scan(self.bytes, self.at)
            && let Some(value) = decimal.to_f64()
        {
            // Rounding twice is right unless the first time ended half-way between two f32
            let narrow = value as f32;
            if value.to_bits() & 0x1fff_ffff != 0x1000_0000 {
                self.at = decimal.end;
                return Some(narrow);
            }
        }
        self.slow(|word| word.parse().ok(), f32::NAN, f32::INFINITY)
    }

    /// The number that begins here; `None`, and no step forward, if none does.
    #[inline(always)]
    pub(super) fn f64(&mut self) -> Option<f64> {
        if let Some(decimal) = Decimal::scan(self.bytes, self.at)
            && let Some(value) = decimal.to_f64()
        {
            self.at = decimal.end;
            return Some(value);
        }
        self.slow(|word| word.parse().ok(), f64::NAN, f64::INFINITY)
    }

    /// Any number, as the standard library reads it; also the NaN and infinity of old Windows programs.
    #[cold]
    #[inline(never)]
    fn slow<T: std::ops::Neg<Output = T>>(&mut self, parse: impl Fn(&str) -> Option<T>, nan: T, inf: T) -> Option<T> {
        let mut rest = self.clone();
        let word = std::str::from_utf8(rest.word()).ok()?;
        let value = parse(word).or_else(|| {
            let lower = word.get(..word.len().min(12))?.to_ascii_lowercase();
            let (negative, size) = match lower.strip_prefix('-') {
                Some(size) => (true, size),
                None => (false, lower.as_str()),
            };
            let value = match size {
                "1.#inf" | "1.#inf00" | "1.#inf000" => inf,
                _ if size.starts_with("1.#") || size.starts_with("nan(") => nan,
                _ => return None,
            };
            Some(if negative { -value } else { value })
        })?;
        self.at = rest.at;
        Some(value)
    }

    /// The whole number that begins here; `None`, and no step forward, if none does or it is beyond 18 digits.
    #[inline(always)]
    pub(super) fn whole(&mut self) -> Option<i64> {
        let mut i = self.at;
        let negative = self.peek() == Some(b'-');
        i += usize::from(negative || self.peek() == Some(b'+'));
        let first = i;
        let mut value = 0i64;
        while let Some(digit) = digit(self.bytes, i) {
            value = value.wrapping_mul(10).wrapping_add(digit as i64);
            i += 1;
        }
        if i == first || i - first > 18 || !ends_word(self.bytes, i) {
            return None;
        }
        self.at = i;
        Some(if negative { -value } else { value })
    }
}

#[inline(always)]
fn digit(bytes: &[u8], at: usize) -> Option<u64> {
    let digit = bytes.get(at)?.wrapping_sub(b'0');
    (digit < 10).then_some(u64::from(digit))
}

#[inline(always)]
fn ends_word(bytes: &[u8], at: usize) -> bool {
    bytes.get(at).is_none_or(|&b| is_blank(b) || is_line_end(b))
}

/// A number as written: `digits` times ten to the `exponent`.
struct Decimal {
    negative: bool,
    digits: u64,
    exponent: i32,
    end: usize,
}

const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22,
];

impl Decimal {
    /// Of at most 19 digits, and a word of its own.
    #[inline(always)]
    fn scan(bytes: &[u8], at: usize) -> Option<Self> {
        let mut i = at;
        let sign = bytes.get(i).copied();
        let negative = sign == Some(b'-');
        i += usize::from(negative || sign == Some(b'+'));
        // Digits before and after the point
        let first = i;
        let mut digits = 0u64;
        while let Some(digit) = digit(bytes, i) {
            digits = digits.wrapping_mul(10).wrapping_add(digit);
            i += 1;
        }
        let mut count = i - first;
        let mut exponent = 0;
        if bytes.get(i) == Some(&b'.') {
            i += 1;
            let point = i;
            while let Some(digit) = digit(bytes, i) {
                digits = digits.wrapping_mul(10).wrapping_add(digit);
                i += 1;
            }
            count += i - point;
            exponent = -i32::try_from(i - point).ok()?;
        }
        if count == 0 || count > 19 {
            return None;
        }
        // The power of ten
        if let Some(b'e' | b'E') = bytes.get(i) {
            let sign = bytes.get(i + 1).copied();
            let down = sign == Some(b'-');
            i += 1 + usize::from(down || sign == Some(b'+'));
            let first = i;
            let mut power = 0;
            while let Some(digit) = digit(bytes, i) {
                if i - first >= 4 {
                    return None;
                }
                power = power * 10 + digit as i32;
                i += 1;
            }
            if i == first {
                return None;
            }
            exponent += if down { -power } else { power };
        }
        ends_word(bytes, i).then_some(Self { negative, digits, exponent, end: i })
    }

    /// Correctly rounded, where two exact numbers and one operation do it.
    #[inline(always)]
    fn to_f64(&self) -> Option<f64> {
        if self.digits > 1 << 53 || !(-22..=22).contains(&self.exponent) {
            return None;
        }
        let power = POWERS[self.exponent.unsigned_abs() as usize];
        let size = if self.exponent < 0 { self.digits as f64 / power } else { self.digits as f64 * power };
        Some(if self.negative { -size } else { size })
    }
}

/// Cuts `bytes[start..]` into pieces of about `size` bytes for which `cut(end)` holds at every inner boundary; each
/// begins after a line end.
pub(super) fn pieces(bytes: &[u8], start: usize, size: usize, cut: impl Fn(usize) -> bool) -> Vec<Range<usize>> {
    let mut pieces = Vec::new();
    let mut from = start;
    while from < bytes.len() {
        let mut end = from.saturating_add(size).min(bytes.len());
        // Go on to the next line that may begin a piece
        while end < bytes.len() {
            let before = bytes[end - 1];
            let within_crlf = before == b'\r' && bytes[end] == b'\n';
            if is_line_end(before) && !within_crlf && cut(end) {
                break;
            }
            end += 1;
        }
        pieces.push(from..end);
        from = end;
    }
    pieces
}

/// What Windows-1252 has for the bytes 0x80 to 0x9f; the others are those of Latin-1.
const WINDOWS_1252: [char; 32] = [
    '\u{20ac}', '\u{81}', '\u{201a}', '\u{192}', '\u{201e}', '\u{2026}', '\u{2020}', '\u{2021}', '\u{2c6}', '\u{2030}',
    '\u{160}', '\u{2039}', '\u{152}', '\u{8d}', '\u{17d}', '\u{8f}', '\u{90}', '\u{2018}', '\u{2019}', '\u{201c}',
    '\u{201d}', '\u{2022}', '\u{2013}', '\u{2014}', '\u{2dc}', '\u{2122}', '\u{161}', '\u{203a}', '\u{153}', '\u{9d}',
    '\u{17e}', '\u{178}',
];

/// A name: UTF-8, or else Windows-1252, which every text is. Whether it was the latter.
pub(super) fn decoded(bytes: &[u8]) -> (String, bool) {
    let of_windows = |&byte: &u8| match byte {
        0x80..=0x9f => WINDOWS_1252[usize::from(byte - 0x80)],
        _ => char::from(byte),
    };
    match std::str::from_utf8(bytes) {
        Ok(text) => (text.to_owned(), false),
        Err(_) => (bytes.iter().map(of_windows).collect(), true),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn f32_of(text: &str) -> Option<f32> {
        Cursor { bytes: text.as_bytes(), at: 0 }.f32()
    }

    #[test]
    fn numbers_are_those_of_the_standard_library() {
        let mut random = firstlight_testkit::Random::new(1);
        for i in 0..400_000u32 {
            let state = random.bits();
            let value = f32::from_bits((state >> 32) as u32);
            let text = match i % 4 {
                0 => format!("{value}"),
                1 => format!("{value:e}"),
                2 => format!("{:.6}", (state >> 40) as f64 * 1e-4 - 500.0),
                // Half-way between two f32, and just beside
                _ => {
                    let middle = (f64::from(value) + f64::from(f32::from_bits(value.to_bits() ^ 1))) / 2.0;
                    let beside = f64::from_bits(middle.to_bits().wrapping_add(u64::from(i) % 3).wrapping_sub(1));
                    format!("{beside:e}")
                }
            };
            let expected: f32 = text.parse().unwrap();
            let found = f32_of(&text).unwrap();
            assert!(found.to_bits() == expected.to_bits() || (found.is_nan() && expected.is_nan()), "{text}");
            let wide = Cursor { bytes: text.as_bytes(), at: 0 }.f64().unwrap();
            let expected: f64 = text.parse().unwrap();
            assert!(wide.to_bits() == expected.to_bits() || (wide.is_nan() && expected.is_nan()), "{text}");
        }
    }

    #[test]
    fn odd_numbers() {
        for text in ["1.", ".5", "+1", "1e5", "-0", "1e-60", "1e60", "0.1000000000000000055511151231257827"] {
            assert_eq!(f32_of(text).unwrap().to_bits(), text.parse::<f32>().unwrap().to_bits(), "{text}");
        }
        for text in ["", ".", "-", "e5", "1e", "1e+", "0x10", "1,5", "1f", "1.2.3", "--1", "\u{e4}"] {
            assert_eq!(f32_of(text), None, "{text}");
        }
        for text in ["nan", "NaN", "-nan", "-nan(ind)", "1.#QNAN", "-1.#IND", "1.#QNAN0"] {
            assert!(f32_of(text).unwrap().is_nan(), "{text}");
        }
        assert_eq!((f32_of("inf"), f32_of("-1.#INF")), (Some(f32::INFINITY), Some(f32::NEG_INFINITY)));
    }

    #[test]
    fn pieces_end_with_lines() {
        let text = b"one\r\ntwo\rthree\nfour";
        for size in 1..30 {
            let pieces = pieces(text, 0, size, |_| true);
            let all: Vec<u8> = pieces.iter().flat_map(|p| text[p.clone()].to_vec()).collect();
            assert_eq!(all, text);
            for piece in &pieces[1..] {
                assert!([5, 9, 15].contains(&piece.start), "{piece:?}");
            }
        }
    }
}
