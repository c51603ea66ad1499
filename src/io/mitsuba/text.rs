//! One source text: read within limits, checked before the XML parser sees it, byte offset → place.
//!
//! The depth of nesting is counted by a scan of our own, so that hostile input meets a bounded stack
//! everywhere behind it. Columns are counted in characters; a count per block of bytes keeps each
//! look-up short even when the whole file is one line.

use crate::describe::{Place, Problems};
use std::io::Read;
use std::path::Path;

/// Deepest nesting of elements that is read.
pub const MAX_DEPTH: usize = 256;
/// Longest scene file that is read, in bytes.
pub const MAX_BYTES: u64 = 1 << 30;
const BLOCK: usize = 512;

/// Converts byte offsets of one text into places.
pub struct Locator {
    file: u32,
    lines: Vec<usize>,
    blocks: Vec<u32>,
}

impl Locator {
    /// Indexes a text; `file` is the number that its places carry.
    pub fn new(text: &str, file: u32) -> Self {
        let mut lines = vec![0];
        let mut blocks = Vec::with_capacity(text.len() / BLOCK + 1);
        let mut chars = 0;
        for (at, &byte) in text.as_bytes().iter().enumerate() {
            if at % BLOCK == 0 {
                blocks.push(chars);
            }
            chars += u32::from(starts_char(byte));
            if byte == b'\n' {
                lines.push(at + 1);
            }
        }
        blocks.push(chars);
        Self { file, lines, blocks }
    }

    /// The place of a byte offset.
    pub fn place(&self, text: &str, offset: usize) -> Place {
        let offset = offset.min(text.len());
        let line = self.lines.partition_point(|&start| start <= offset);
        let column = self.chars_before(text, offset) - self.chars_before(text, self.lines[line - 1]) + 1;
        Place { file: self.file, line: line as u32, column }
    }

    fn chars_before(&self, text: &str, offset: usize) -> u32 {
        let block = offset / BLOCK;
        let rest = &text.as_bytes()[block * BLOCK..offset];
        self.blocks[block] + rest.iter().filter(|&&b| starts_char(b)).count() as u32
    }
}

fn starts_char(byte: u8) -> bool {
    byte & 0xC0 != 0x80
}

/// Reads a regular file of at most [`MAX_BYTES`] as UTF-8, or says in one line why not.
pub fn read(path: &Path) -> Result<String, String> {
    let shown = path.display();
    let metadata = std::fs::metadata(path).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => format!("file `{shown}` not found"),
        _ => format!("cannot read `{shown}`: {e}"),
    })?;
    if metadata.is_dir() {
        return Err(format!("`{shown}` is a directory"));
    }
    if !metadata.is_file() {
        return Err(format!("`{shown}` is not a regular file"));
    }
    if metadata.len() > MAX_BYTES {
        return Err(format!("`{shown}` is {} MiB long; a scene file may have {} MiB", metadata.len() >> 20, MAX_BYTES >> 20));
    }
    let mut bytes = Vec::with_capacity(metadata.len() as usize);
    let read = std::fs::File::open(path).and_then(|f| f.take(MAX_BYTES).read_to_end(&mut bytes));
    read.map_err(|e| format!("cannot read `{shown}`: {e}"))?;
    if bytes.starts_with(&[0xFF, 0xFE]) || bytes.starts_with(&[0xFE, 0xFF]) {
        return Err(format!("`{shown}` is UTF-16; save it as UTF-8"));
    }
    String::from_utf8(bytes).map_err(|e| {
        let at = e.utf8_error().valid_up_to();
        let line = e.as_bytes()[..at].iter().filter(|&&b| b == b'\n').count() + 1;
        let byte = e.as_bytes()[at];
        format!("`{shown}` is not text: byte 0x{byte:02x} at offset {at} (line {line}) is not UTF-8")
    })
}

/// Reports what must not reach the XML parser: no text at all, DTDs, nesting deeper than [`MAX_DEPTH`].
pub fn check(text: &str, locator: &Locator, problems: &mut Problems) -> bool {
    let body = text.trim_start_matches(['\u{feff}', ' ', '\t', '\r', '\n']);
    let start = text.len() - body.len();
    if body.is_empty() {
        problems.error(locator.place(text, 0), "the file is empty").hint("a scene starts with <scene version=\"3.0.0\">");
        return false;
    }
    if !body.starts_with('<') {
        problems
            .error(locator.place(text, start), "this is not an XML file: it does not start with `<`")
            .hint("a scene starts with <scene version=\"3.0.0\">");
        return false;
    }
    match scan(text.as_bytes()) {
        Scan::Fine => true,
        Scan::Dtd(at) => {
            problems
                .error(locator.place(text, at), "a document type definition (<!DOCTYPE …>) is not read")
                .hint("remove it; entities are never expanded, use <default> and <include> instead");
            false
        }
        Scan::Deep(at) => {
            problems.error(locator.place(text, at), format!("elements are nested deeper than {MAX_DEPTH}"));
            false
        }
    }
}

enum Scan {
    Fine,
    Dtd(usize),
    Deep(usize),
}

/// Walks over the tags without building anything; malformed text is left for the parser to report.
fn scan(bytes: &[u8]) -> Scan {
    let (mut at, mut depth) = (0, 0usize);
    while let Some(open) = find(bytes, at, b"<") {
        let rest = &bytes[open..];
        at = if rest.starts_with(b"<!--") {
            after(bytes, open + 4, b"-->")
        } else if rest.starts_with(b"<![CDATA[") {
            after(bytes, open + 9, b"]]>")
        } else if rest.starts_with(b"<?") {
            after(bytes, open + 2, b"?>")
        } else if rest.starts_with(b"<!") {
            return Scan::Dtd(open);
        } else if rest.starts_with(b"</") {
            depth = depth.saturating_sub(1);
            after(bytes, open + 2, b">")
        } else {
            let end = end_of_tag(bytes, open + 1);
            if end < 2 || bytes.get(end - 2) != Some(&b'/') {
                depth += 1;
            }
            if depth > MAX_DEPTH {
                return Scan::Deep(open);
            }
            end
        };
    }
    Scan::Fine
}

/// The offset after the `>` that ends a tag, quotes respected.
fn end_of_tag(bytes: &[u8], mut at: usize) -> usize {
    let mut quote = None;
    while let Some(&byte) = bytes.get(at) {
        at += 1;
        match quote {
            Some(q) if q == byte => quote = None,
            Some(_) => {}
            None if byte == b'"' || byte == b'\'' => quote = Some(byte),
            None if byte == b'>' => return at,
            None => {}
        }
    }
    bytes.len()
}

fn find(bytes: &[u8], from: usize, what: &[u8]) -> Option<usize> {
    let rest = bytes.get(from..)?;
    if let [single] = what {
        return rest.iter().position(|b| b == single).map(|i| from + i);
    }
    rest.windows(what.len()).position(|w| w == what).map(|i| from + i)
}

fn after(bytes: &[u8], from: usize, what: &[u8]) -> usize {
    find(bytes, from, what).map_or(bytes.len(), |i| i + what.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_count_lines_and_characters_from_one() {
        let text = format!("a\nüé<x\n{}é!", "ö".repeat(2000));
        let locator = Locator::new(&text, 1);
        let at = |needle| locator.place(&text, text.find(needle).unwrap());
        assert_eq!(at("a"), Place { file: 1, line: 1, column: 1 });
        assert_eq!(at("<"), Place { file: 1, line: 2, column: 3 });
        assert_eq!(at("!"), Place { file: 1, line: 3, column: 2002 });
        assert_eq!(locator.place(&text, text.len() + 9).line, 3);
    }

    #[test]
    fn depth_is_counted_over_comments_quotes_and_empty_elements() {
        let nested = |n: usize| "<a b='/>'>".repeat(n) + "<!-- <a> --><b/>" + &"</a>".repeat(n);
        assert!(matches!(scan(nested(255).as_bytes()), Scan::Fine));
        assert!(matches!(scan(nested(257).as_bytes()), Scan::Deep(_)));
        assert!(matches!(scan("<a/>".repeat(1000).as_bytes()), Scan::Fine));
        assert!(matches!(scan(b"<!DOCTYPE x>"), Scan::Dtd(0)));
    }
}
