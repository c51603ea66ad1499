//! The header of a PLY file: encoding, elements, properties.

use super::super::fault::{Fault, escape};

/// How the body is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    Ascii,
    Little,
    Big,
}

/// A number type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn parse(name: &[u8]) -> Option<Self> {
        Some(match name {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes in a binary file.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    pub fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }
}

/// A single number, or a list (type of its length, type of its items).
#[derive(Clone, Copy, Debug)]
pub enum Kind {
    One(Scalar),
    List(Scalar, Scalar),
}

#[derive(Debug)]
pub struct Property {
    pub name: Vec<u8>,
    pub kind: Kind,
}

#[derive(Debug)]
pub struct Element {
    pub name: Vec<u8>,
    pub count: u64,
    pub properties: Vec<Property>,
}

impl Element {
    /// Bytes of one element in a binary file, if all are equally long.
    pub fn stride(&self) -> Option<usize> {
        self.properties.iter().map(|p| if let Kind::One(s) = p.kind { Some(s.size()) } else { None }).sum()
    }

    /// Offset and type of a property in an element of fixed stride.
    pub fn offset(&self, property: usize) -> (usize, Scalar) {
        let first = |k: Kind| match k {
            Kind::One(s) | Kind::List(s, _) => s,
        };
        let before = self.properties[..property].iter().map(|p| first(p.kind).size()).sum();
        (before, first(self.properties[property].kind))
    }

    /// The fewest bytes that one element can take.
    pub fn least_bytes(&self, encoding: Encoding) -> usize {
        let least = |p: &Property| match (encoding, p.kind) {
            // A digit and a separator (the last separator of the file may be missing).
            (Encoding::Ascii, _) => 2,
            (_, Kind::One(s) | Kind::List(s, _)) => s.size(),
        };
        self.properties.iter().map(least).sum()
    }
}

#[derive(Debug)]
pub struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// Bytes of the header with its last line end.
    pub length: usize,
}

impl Header {
    pub fn parse(bytes: &[u8]) -> Result<Self, Fault> {
        if !(bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r")) {
            let fault = if bytes.is_empty() {
                Fault::new("is empty")
            } else {
                Fault::new(format!("is not a PLY file (it starts with `{}`)", escape(bytes)))
            };
            return Err(fault);
        }
        let (mut encoding, mut elements, mut at, mut line) = (None, Vec::<Element>::new(), 0, 0);
        loop {
            let rest = &bytes[at..];
            let Some(length) = rest.iter().position(|&b| b == b'\n' || b == b'\r') else {
                return Err(Fault::new(format!("line {}: the header has no `end_header`", line + 1)).hint("the file is cut off"));
            };
            line += 1;
            let words: Vec<&[u8]> = rest[..length].split(|b| b.is_ascii_whitespace()).filter(|w| !w.is_empty()).collect();
            at += length + if rest[length..].starts_with(b"\r\n") { 2 } else { 1 };
            let malformed =
                || Fault::new(format!("line {line}: `{}` is not a PLY header line", escape(rest[..length].trim_ascii())));
            match words.as_slice() {
                [b"ply"] if line == 1 => {}
                [b"comment" | b"obj_info", ..] | [] => {}
                [b"end_header"] => break,
                [b"format", name, b"1.0"] => {
                    encoding = Some(match *name {
                        b"ascii" => Encoding::Ascii,
                        b"binary_little_endian" => Encoding::Little,
                        b"binary_big_endian" => Encoding::Big,
                        _ => return Err(malformed()),
                    });
                }
                [b"element", name, count] => {
                    let count = std::str::from_utf8(count)
                        .ok()
                        .filter(|c| c.bytes().all(|b| b.is_ascii_digit()))
                        .ok_or_else(malformed)?;
                    let count = count.parse().map_err(|_| {
                        Fault::new(format!("line {line}: the count {} does not fit in 64 bits", escape(count.as_bytes())))
                    })?;
                    elements.push(Element { name: name.to_vec(), count, properties: Vec::new() });
                }
                [b"property", kind @ .., name] => {
                    let kind = match kind {
                        [one] => Scalar::parse(one).map(Kind::One),
                        [b"list", length, item] => Scalar::parse(length).zip(Scalar::parse(item)).map(|(l, i)| Kind::List(l, i)),
                        _ => None,
                    };
                    let property = Property { name: name.to_vec(), kind: kind.ok_or_else(malformed)? };
                    elements.last_mut().ok_or_else(malformed)?.properties.push(property);
                }
                _ => return Err(malformed()),
            }
        }
        let encoding = encoding.ok_or_else(|| Fault::new("the header has no `format` line"))?;
        Ok(Self { encoding, elements, length: at })
    }
}
