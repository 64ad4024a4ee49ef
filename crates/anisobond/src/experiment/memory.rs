//! The memory of the machine.

use crate::{Error, Result};

/// Memory of the machine, or of the container that the program is in (bytes); `None` where the system does not say.
pub fn machine_memory() -> Option<u64> {
    let read = |path: &str| std::fs::read_to_string(path).ok();
    let kilobytes = read("/proc/meminfo")?
        .lines()
        .find_map(|line| line.strip_prefix("MemTotal:")?.trim().strip_suffix("kB")?.trim().parse::<u64>().ok())?;
    // "max" where there is no limit.
    let limit = read("/sys/fs/cgroup/memory.max").and_then(|text| text.trim().parse::<u64>().ok());
    Some((kilobytes << 10).min(limit.unwrap_or(u64::MAX)))
}

/// Refuses what needs more memory (bytes) than the machine has, before it is taken.
///
/// # Errors
/// More than the machine has; `what` names it.
pub fn refuse_beyond_memory(what: &str, bytes: f64) -> Result<()> {
    match machine_memory() {
        Some(memory) if bytes > memory as f64 => Err(Error::input(
            format!(
                "{what} would take about {:.3e} GB, and this machine has {:.0} GB",
                bytes / 1e9,
                memory as f64 / 1e9
            ),
            "use a larger spacing, a smaller horizon or body, or a larger machine",
        )),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_machine_holds_is_refused() {
        assert!(refuse_beyond_memory("nothing", 0.0).is_ok());
        if machine_memory().is_some() {
            assert!(refuse_beyond_memory("a run", 1e18).unwrap_err().to_string().contains("a run would take about"));
        }
    }
}
