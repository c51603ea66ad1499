//! Memory of this process, where the system tells it.

/// Resident now, in bytes.
pub fn resident() -> Option<u64> {
    status("VmRSS:")
}

/// The most that was resident so far, in bytes.
pub fn peak() -> Option<u64> {
    status("VmHWM:")
}

fn status(field: &str) -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find(|l| l.starts_with(field))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kb| kb * 1024)
}
