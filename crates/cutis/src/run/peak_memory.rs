//! The peak of the memory of this process, as the system reports it. Linux only.

use std::fs;

/// A measurement of the peak since its start.
pub(crate) struct PeakMemory {
    /// Whether the system has forgotten earlier peaks.
    fresh: bool,
}

impl PeakMemory {
    /// Starts a measurement. It ends those that began before.
    pub(crate) fn start() -> Self {
        // 5 resets the peak and nothing else (proc_pid_clear_refs(5)).
        Self { fresh: fs::write("/proc/self/clear_refs", "5").is_ok() }
    }

    /// The peak of the resident memory since the start, bytes. None if the system does not tell.
    pub(crate) fn bytes(&self) -> Option<u64> {
        let status = fs::read_to_string("/proc/self/status").ok().filter(|_| self.fresh)?;
        peak_in(&status)
    }
}

/// The peak in bytes that a `/proc/self/status` names.
fn peak_in(status: &str) -> Option<u64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kib: u64 = line.split_whitespace().next()?.parse().ok()?;
    kib.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_peak_is_read_from_the_status() {
        assert_eq!(peak_in("Name:\tcutis\nVmHWM:\t    1536 kB\nVmRSS:\t 9 kB\n"), Some(1536 * 1024));
        for status in ["", "VmHWM:", "VmHWM: much kB", "VmRSS: 9 kB"] {
            assert_eq!(peak_in(status), None, "{status}");
        }
    }
}
