//! The body of a PLY file: numbers one after the other, as text or as bytes of either order.

use super::super::fault::{Fault, escape};
use super::header::{Kind, Scalar};

/// A stream of typed numbers.
pub trait Source {
    /// The next number as f32.
    fn number(&mut self, scalar: Scalar) -> Result<f32, Fault>;

    /// The next number, which is of an integer type.
    fn integer(&mut self, scalar: Scalar) -> Result<i64, Fault>;

    /// Passes over a property.
    fn skip(&mut self, kind: Kind) -> Result<(), Fault>;

    /// Where the last number stood, as ` (…)` for a message.
    fn position(&self) -> String;

    /// Bytes after the last number, apart from white space in text.
    fn left(&self) -> usize;

    /// The next bytes as a block, where elements have a fixed stride.
    fn block(&mut self, _bytes: usize) -> Option<&[u8]> {
        None
    }

    /// A number at the start of a block; 0 where there are no blocks.
    fn decode(_bytes: &[u8], _scalar: Scalar) -> f64 {
        0.0
    }

    /// The next list, if it consists of three valid indices and can be read quickly. Otherwise
    /// nothing is consumed.
    fn short_triangle(&mut self, _length: Scalar, _item: Scalar, _vertices: u32) -> Option<[u32; 3]> {
        None
    }
}

/// Text: numbers between white space.
pub struct Ascii<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Start of the last word.
    word: usize,
}

impl<'a> Ascii<'a> {
    pub fn new(bytes: &'a [u8], at: usize) -> Self {
        Self { bytes, at, word: at }
    }

    fn word(&mut self) -> Result<&'a str, Fault> {
        let rest = &self.bytes[self.at..];
        let start = rest.iter().position(|b| !b.is_ascii_whitespace()).unwrap_or(rest.len());
        let length = rest[start..].iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len() - start);
        self.word = self.at + start;
        self.at = self.word + length;
        if length == 0 {
            return Err(Fault::new(format!("the file ends here{}", self.position())));
        }
        let word = &self.bytes[self.word..self.at];
        std::str::from_utf8(word).map_err(|_| self.malformed(word))
    }

    fn malformed(&self, word: &[u8]) -> Fault {
        Fault::new(format!("`{}` is not a number of the announced type{}", escape(word), self.position()))
    }
}

impl Source for Ascii<'_> {
    fn number(&mut self, scalar: Scalar) -> Result<f32, Fault> {
        if !scalar.is_float() {
            return Ok(self.integer(scalar)? as f32);
        }
        let word = self.word()?;
        word.parse().map_err(|_| self.malformed(word.as_bytes()))
    }

    fn integer(&mut self, _scalar: Scalar) -> Result<i64, Fault> {
        let word = self.word()?;
        word.parse().map_err(|_| self.malformed(word.as_bytes()))
    }

    fn skip(&mut self, kind: Kind) -> Result<(), Fault> {
        let count = match kind {
            Kind::One(_) => 1,
            Kind::List(length, _) => self.integer(length)?,
        };
        // Ends with the file at the latest.
        for _ in 0..count {
            self.word()?;
        }
        Ok(())
    }

    fn position(&self) -> String {
        let line = 1 + self.bytes[..self.word].iter().filter(|&&b| b == b'\n').count();
        format!(" (line {line})")
    }

    fn left(&self) -> usize {
        self.bytes[self.at..].trim_ascii().len()
    }
}

/// Bytes, the most significant first if `BIG`.
pub struct Binary<'a, const BIG: bool> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a, const BIG: bool> Binary<'a, BIG> {
    pub fn new(bytes: &'a [u8], at: usize) -> Self {
        Self { bytes, at }
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], Fault> {
        match self.at.checked_add(count).and_then(|end| self.bytes.get(self.at..end)) {
            Some(taken) => {
                self.at += count;
                Ok(taken)
            }
            None => {
                let left = self.bytes.len() - self.at;
                let what = format!("the file ends after {left} of {count} bytes (byte {})", self.at);
                Err(Fault::new(what).hint("the file is cut off"))
            }
        }
    }

    fn u32_at(bytes: &[u8]) -> u32 {
        let b = [bytes[0], bytes[1], bytes[2], bytes[3]];
        if BIG { u32::from_be_bytes(b) } else { u32::from_le_bytes(b) }
    }

    fn integer_in(b: &[u8], scalar: Scalar) -> i64 {
        match scalar {
            Scalar::I8 => i64::from(b[0] as i8),
            Scalar::U8 => i64::from(b[0]),
            Scalar::I16 | Scalar::U16 => {
                let u = if BIG { u16::from_be_bytes([b[0], b[1]]) } else { u16::from_le_bytes([b[0], b[1]]) };
                if scalar == Scalar::I16 { i64::from(u as i16) } else { i64::from(u) }
            }
            Scalar::I32 => i64::from(Self::u32_at(b) as i32),
            Scalar::U32 => i64::from(Self::u32_at(b)),
            Scalar::F32 | Scalar::F64 => Self::decode(b, scalar) as i64,
        }
    }
}

impl<const BIG: bool> Source for Binary<'_, BIG> {
    fn number(&mut self, scalar: Scalar) -> Result<f32, Fault> {
        Ok(Self::decode(self.take(scalar.size())?, scalar) as f32)
    }

    fn integer(&mut self, scalar: Scalar) -> Result<i64, Fault> {
        Ok(Self::integer_in(self.take(scalar.size())?, scalar))
    }

    fn skip(&mut self, kind: Kind) -> Result<(), Fault> {
        let count = match kind {
            Kind::One(scalar) => scalar.size(),
            Kind::List(length, item) => {
                let items = self.integer(length)?;
                usize::try_from(items)
                    .ok()
                    .and_then(|n| n.checked_mul(item.size()))
                    .ok_or_else(|| Fault::new(format!("a list cannot have {items} items (byte {})", self.at)))?
            }
        };
        self.take(count).map(|_| ())
    }

    fn position(&self) -> String {
        format!(" (before byte {})", self.at)
    }

    fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    fn block(&mut self, bytes: usize) -> Option<&[u8]> {
        self.take(bytes).ok()
    }

    #[inline]
    fn decode(b: &[u8], scalar: Scalar) -> f64 {
        match scalar {
            Scalar::F32 => f64::from(f32::from_bits(Self::u32_at(b))),
            Scalar::F64 => {
                let (first, second) = (u64::from(Self::u32_at(b)), u64::from(Self::u32_at(&b[4..])));
                f64::from_bits(if BIG { first << 32 | second } else { second << 32 | first })
            }
            _ => Self::integer_in(b, scalar) as f64,
        }
    }

    #[inline]
    fn short_triangle(&mut self, length: Scalar, item: Scalar, vertices: u32) -> Option<[u32; 3]> {
        let quick = matches!(length, Scalar::U8 | Scalar::I8) && matches!(item, Scalar::I32 | Scalar::U32);
        let bytes = self.bytes.get(self.at..)?.get(..13).filter(|b| quick && b[0] == 3)?;
        let triangle = [Self::u32_at(&bytes[1..]), Self::u32_at(&bytes[5..]), Self::u32_at(&bytes[9..])];
        // A negative i32 is a large u32, which no vertex count admits.
        triangle.iter().all(|&i| i < vertices).then(|| {
            self.at += 13;
            triangle
        })
    }
}
