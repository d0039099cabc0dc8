//! Where the values of a PLY file come from, one after another: text, or binary data of either byte order.

use super::super::ImportFault;
use super::super::error::{WRITE_ANEW, shown};
use super::super::text::Cursor;
use super::header::{DataEncoding, Scalar};

/// Values in their order.
pub(super) trait Source {
    /// The next byte.
    fn offset(&self) -> usize;

    /// The next value.
    fn value(&mut self, scalar: Scalar) -> Result<f64, ImportFault>;

    /// The next value, which must be whole.
    fn whole(&mut self, scalar: Scalar) -> Result<i64, ImportFault>;

    /// Goes past `count` values.
    fn skip(&mut self, scalar: Scalar, count: u64) -> Result<(), ImportFault>;

    /// A row is done.
    fn end_row(&mut self) -> Result<(), ImportFault>;

    /// A fault at a byte.
    fn fault(&self, offset: usize, message: String, hint: &'static str) -> ImportFault;
}

/// One binary value at the start of `bytes`.
#[inline(always)]
pub(super) fn binary_value(bytes: &[u8], scalar: Scalar, big: bool) -> f64 {
    macro_rules! get {
        ($type:ty, $size:literal) => {{
            let b: [u8; $size] = bytes[..$size].try_into().expect("as many bytes as asked for");
            (if big { <$type>::from_be_bytes(b) } else { <$type>::from_le_bytes(b) }) as f64
        }};
    }
    match scalar {
        Scalar::I8 => get!(i8, 1),
        Scalar::U8 => get!(u8, 1),
        Scalar::I16 => get!(i16, 2),
        Scalar::U16 => get!(u16, 2),
        Scalar::I32 => get!(i32, 4),
        Scalar::U32 => get!(u32, 4),
        Scalar::F32 => get!(f32, 4),
        Scalar::F64 => get!(f64, 8),
    }
}

/// Binary data.
pub(super) struct Binary<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) at: usize,
    pub(super) big: bool,
}

impl<'a> Binary<'a> {
    pub(super) fn new(bytes: &'a [u8], at: usize, encoding: DataEncoding) -> Self {
        Self { bytes, at, big: encoding == DataEncoding::Big }
    }

    #[cold]
    fn ended(&self) -> ImportFault {
        ImportFault::binary(self.bytes.len(), "the file ends within a row", WRITE_ANEW)
    }
}

impl Source for Binary<'_> {
    fn offset(&self) -> usize {
        self.at
    }

    #[inline(always)]
    fn value(&mut self, scalar: Scalar) -> Result<f64, ImportFault> {
        let rest = &self.bytes[self.at..];
        if rest.len() < scalar.size() {
            return Err(self.ended());
        }
        self.at += scalar.size();
        Ok(binary_value(rest, scalar, self.big))
    }

    #[inline(always)]
    fn whole(&mut self, scalar: Scalar) -> Result<i64, ImportFault> {
        let at = self.at;
        let value = self.value(scalar)?;
        if value as i64 as f64 != value {
            return Err(self.fault(at, format!("{value} where a whole number is needed"), WRITE_ANEW));
        }
        Ok(value as i64)
    }

    #[inline(always)]
    fn skip(&mut self, scalar: Scalar, count: u64) -> Result<(), ImportFault> {
        let left = (self.bytes.len() - self.at) as u64;
        match count.checked_mul(scalar.size() as u64).filter(|&size| size <= left) {
            Some(size) => self.at += size as usize,
            None => return Err(self.ended()),
        }
        Ok(())
    }

    #[inline(always)]
    fn end_row(&mut self) -> Result<(), ImportFault> {
        Ok(())
    }

    #[cold]
    fn fault(&self, offset: usize, message: String, hint: &'static str) -> ImportFault {
        ImportFault::binary(offset, message, hint)
    }
}

/// Text: numbers between blanks. Either a row to a line, or `free`: wherever lines end.
pub(super) struct Text<'a> {
    pub(super) cursor: Cursor<'a>,
    pub(super) free: bool,
}

impl Text<'_> {
    #[inline(always)]
    fn go_to_value(&mut self) {
        if self.free { self.cursor.skip_space() } else { self.cursor.skip_blanks() }
    }

    #[cold]
    fn no_number(&self, needed: &str) -> ImportFault {
        let (at, word) = (self.cursor.at, self.cursor.next_word());
        if self.cursor.at_end() {
            ImportFault::text(at, "the file ends within a row", WRITE_ANEW)
        } else if word.is_empty() {
            ImportFault::text(at, "the line ends, but its row has more values", "write each row on a line of its own")
        } else {
            ImportFault::text(at, format!("{} where {needed} is needed", shown(word)), WRITE_ANEW)
        }
    }
}

impl Source for Text<'_> {
    fn offset(&self) -> usize {
        self.cursor.at
    }

    #[inline(always)]
    fn value(&mut self, scalar: Scalar) -> Result<f64, ImportFault> {
        self.go_to_value();
        // A double is what its text says, rounded to a double first: as in the binary formats
        let value = if scalar == Scalar::F32 { self.cursor.f32().map(f64::from) } else { self.cursor.f64() };
        value.ok_or_else(|| self.no_number("a number"))
    }

    #[inline(always)]
    fn whole(&mut self, _: Scalar) -> Result<i64, ImportFault> {
        self.go_to_value();
        if let Some(value) = self.cursor.whole() {
            return Ok(value);
        }
        // Some write whole numbers as fractions
        let mut after = self.cursor.clone();
        match after.f64().filter(|&value| value as i64 as f64 == value) {
            Some(value) => {
                self.cursor = after;
                Ok(value as i64)
            }
            None => Err(self.no_number("a whole number")),
        }
    }

    fn skip(&mut self, _: Scalar, count: u64) -> Result<(), ImportFault> {
        for _ in 0..count {
            self.go_to_value();
            if self.cursor.word().is_empty() {
                return Err(self.no_number("a number"));
            }
        }
        Ok(())
    }

    #[inline(always)]
    fn end_row(&mut self) -> Result<(), ImportFault> {
        if self.free {
            return Ok(());
        }
        self.cursor.skip_blanks();
        if !self.cursor.at_line_end() {
            let message = format!("{} after the last value of the row", shown(self.cursor.next_word()));
            return Err(ImportFault::text(self.cursor.at, message, "write each row on a line of its own"));
        }
        self.cursor.pass_line_end();
        Ok(())
    }

    #[cold]
    fn fault(&self, offset: usize, message: String, hint: &'static str) -> ImportFault {
        ImportFault::text(offset, message, hint)
    }
}
