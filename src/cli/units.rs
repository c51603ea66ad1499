//! Values on the command line: durations, sizes, crop windows, amounts of memory.
//!
//! Each parser says what it expects, with an example, since clap shows just that sentence.

use super::args::MaxLength;
use std::time::Duration;

/// Edges of the longest path, or `auto`.
pub fn max_length(text: &str) -> Result<MaxLength, String> {
    if text == "auto" {
        return Ok(MaxLength::Auto);
    }
    text.parse().map(MaxLength::Edges).map_err(|_| "expected a number of edges, or auto".into())
}

/// `20s`, `5m`, `1h30m`, `250ms`, or plain seconds.
pub fn duration(text: &str) -> Result<Duration, String> {
    let expected = || "expected a time such as 20s, 5m or 1h30m".to_owned();
    let mut seconds = 0.0;
    let mut rest = text.trim();
    if rest.is_empty() {
        return Err(expected());
    }
    while !rest.is_empty() {
        let digits = rest.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(rest.len());
        let (number, tail) = rest.split_at(digits);
        let letters = tail.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(tail.len());
        let (unit, tail) = tail.split_at(letters);
        let factor = match unit {
            "" | "s" => 1.0,
            "ms" => 1e-3,
            "m" | "min" => 60.0,
            "h" => 3600.0,
            _ => return Err(expected()),
        };
        seconds += factor * number.parse::<f64>().map_err(|_| expected())?;
        rest = tail;
    }
    if seconds > 0.0 {
        Duration::try_from_secs_f64(seconds).map_err(|_| expected())
    } else {
        Err("must be longer than nothing".into())
    }
}

/// `640x480`.
pub fn size(text: &str) -> Result<[u32; 2], String> {
    let expected = || "expected width and height such as 640x480".to_owned();
    let (w, h) = text.split_once(['x', 'X', '×']).ok_or_else(expected)?;
    let side = |s: &str| s.trim().parse().ok().filter(|n: &u32| *n > 0).ok_or_else(expected);
    Ok([side(w)?, side(h)?])
}

/// `X,Y` in pixels of the whole film.
pub fn pixel(text: &str) -> Result<(u32, u32), String> {
    let expected = || "expected column and row such as 200,120".to_owned();
    let (x, y) = text.split_once(',').ok_or_else(expected)?;
    let number = |s: &str| s.trim().parse().map_err(|_| expected());
    Ok((number(x)?, number(y)?))
}

/// `X,Y,WIDTH,HEIGHT` in pixels of the whole film.
pub fn crop(text: &str) -> Result<[u32; 4], String> {
    let expected = || "expected four whole numbers X,Y,WIDTH,HEIGHT such as 10,20,64,48".to_owned();
    let parts: Vec<u32> = text.split(',').map(|s| s.trim().parse().map_err(|_| expected())).collect::<Result<_, _>>()?;
    match *parts.as_slice() {
        [_, _, 0, _] | [_, _, _, 0] => Err("must hold at least one pixel".into()),
        [x, y, w, h] => Ok([x, y, w, h]),
        _ => Err(expected()),
    }
}

/// `4G`, `512M`, `1.5T` (powers of 1000; `Gi` and so on for powers of 1024), or plain bytes.
pub fn memory(text: &str) -> Result<u64, String> {
    let expected = || "expected an amount of memory such as 8G or 512Mi".to_owned();
    let text = text.trim();
    let digits = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let (number, unit) = text.split_at(digits);
    let number: f64 = number.parse().map_err(|_| expected())?;
    let unit = unit.trim().trim_end_matches(['B', 'b']);
    let (letter, base) = match unit.strip_suffix('i') {
        Some(letter) => (letter, 1024f64),
        None => (unit, 1000.0),
    };
    let power = ["", "k", "M", "G", "T", "P"].iter().position(|p| p.eq_ignore_ascii_case(letter)).ok_or_else(expected)?;
    Ok((number * base.powi(power as i32)) as u64)
}

/// `name=value`.
pub fn define(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.is_empty() => Ok((name.to_owned(), value.to_owned())),
        _ => Err("expected name=value such as spp=64".into()),
    }
}

/// Bytes for people: `384 TB`.
pub fn show_bytes(bytes: u64) -> String {
    let mut value = bytes as f64;
    let mut unit = "B";
    for next in ["kB", "MB", "GB", "TB", "PB", "EB"] {
        if value < 1000.0 {
            break;
        }
        (value, unit) = (value / 1000.0, next);
    }
    let digits = usize::from(unit != "B" && value < 10.0);
    format!("{value:.digits$} {unit}")
}

/// A count for people: `3.21 M`.
pub fn show_count(n: f64) -> String {
    match n {
        n if n >= 1e9 => format!("{:.2} G", n / 1e9),
        n if n >= 1e6 => format!("{:.2} M", n / 1e6),
        n if n >= 1e3 => format!("{:.1} k", n / 1e3),
        n => format!("{n:.0} "),
    }
}

/// A time for people: `1h 02m 03s`, `4m 05s`, `7.3 s`.
pub fn show_duration(d: Duration) -> String {
    let s = d.as_secs();
    match s {
        0..60 => format!("{:.1} s", d.as_secs_f64()),
        60..3600 => format!("{}m {:02}s", s / 60, s % 60),
        _ => format!("{}h {:02}m {:02}s", s / 3600, s / 60 % 60, s % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations() {
        let ms = |t: &str| duration(t).map(|d| d.as_millis()).ok();
        assert_eq!(ms("20s"), Some(20_000));
        assert_eq!(ms("5m"), Some(300_000));
        assert_eq!(ms("1h30m"), Some(5_400_000));
        assert_eq!(ms("250ms"), Some(250));
        assert_eq!(ms("1.5"), Some(1500));
        for bad in ["", "s", "5x", "-3s", "0s", "1..2s", "1e400s", "3 s"] {
            assert_eq!(ms(bad), None, "{bad}");
        }
    }

    #[test]
    fn windows() {
        assert_eq!(size("640x480"), Ok([640, 480]));
        assert_eq!(crop("1, 2,3,4"), Ok([1, 2, 3, 4]));
        assert!(["640", "0x3", "3x", "-1x4", "1x2x3"].iter().all(|s| size(s).is_err()));
        assert!(["1,2,3", "1,2,0,4", "a,b,c,d", "1,2,3,4,5", "-1,0,1,1"].iter().all(|s| crop(s).is_err()));
    }

    #[test]
    fn amounts() {
        assert_eq!(memory("4G"), Ok(4_000_000_000));
        assert_eq!(memory("512 MiB"), Ok(512 << 20));
        assert_eq!(memory("100"), Ok(100));
        assert!(["", "G", "4X", "-1G", "1 2"].iter().all(|s| memory(s).is_err()));
        assert_eq!(show_bytes(384_000_000_000_000), "384 TB");
        assert_eq!(show_bytes(1_500), "1.5 kB");
        assert_eq!(show_bytes(17), "17 B");
        assert_eq!(define("a=b=c"), Ok(("a".into(), "b=c".into())));
        assert!(define("=x").is_err() && define("spp").is_err());
    }
}
