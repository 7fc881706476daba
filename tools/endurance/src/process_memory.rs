use anyhow::{Context, Result};
use std::fs;

/// Largest resident memory of this process so far, in bytes.
///
/// # Errors
///
/// Fails if the system does not report it.
pub fn peak_bytes() -> Result<u64> {
    status_bytes("VmHWM:")
}

/// Resident memory of this process, in bytes.
///
/// # Errors
///
/// Fails if the system does not report it.
pub fn resident_bytes() -> Result<u64> {
    status_bytes("VmRSS:")
}

fn status_bytes(key: &str) -> Result<u64> {
    const PATH: &str = "/proc/self/status";
    let status = fs::read_to_string(PATH).with_context(|| format!("{PATH}: cannot read"))?;
    let line = status.lines().find_map(|line| line.strip_prefix(key));
    let kibibytes = line.and_then(|line| line.split_ascii_whitespace().next()?.parse::<u64>().ok());
    Ok(1024 * kibibytes.with_context(|| format!("{PATH}: no number of kB after {key}"))?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn written_memory_is_resident_and_raises_the_peak() {
        const BYTES: usize = 64 << 20;
        let before = resident_bytes().unwrap();
        let written = vec![1_u8; BYTES];
        let with_it = resident_bytes().unwrap();
        drop(std::hint::black_box(written));
        // Other tests of this process run at the same time.
        assert!(with_it > before + BYTES as u64 / 2);
        // The kernel counts in steps.
        assert!(peak_bytes().unwrap() + (1 << 20) >= with_it);
    }
}
