//! Processor time and memory of the browser's processes, from `/proc`.

use std::collections::HashMap;
use std::path::Path;

/// Resources used by a browser's processes so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ResourceUse {
    /// Total processor time, s.
    pub cpu_s: f64,
    /// Resident memory of the process that runs the page, bytes.
    pub page_bytes: u64,
}

/// Resources used by `root` and its descendants; `None` where the system has no `/proc`.
pub(crate) fn resource_use(root: u64) -> Option<ResourceUse> {
    let mut parents: HashMap<u64, u64> = HashMap::new();
    let mut ticks: HashMap<u64, u64> = HashMap::new();
    for entry in std::fs::read_dir("/proc").ok()?.flatten() {
        let Some(id) = entry.file_name().to_str().and_then(|name| name.parse::<u64>().ok()) else { continue };
        let Ok(stat) = std::fs::read_to_string(entry.path().join("stat")) else { continue };
        // The name is in parentheses and may contain any character.
        let Some((_, rest)) = stat.rsplit_once(") ") else { continue };
        let fields: Vec<&str> = rest.split(' ').collect();
        let number =
            |index: usize| fields.get(index).and_then(|field| field.parse::<u64>().ok()).unwrap_or(0);
        parents.insert(id, number(1));
        ticks.insert(id, number(11) + number(12));
    }
    let is_ours = |mut id: u64| {
        while id > 1 {
            if id == root {
                return true;
            }
            id = parents.get(&id).copied().unwrap_or(0);
        }
        false
    };
    let mut all = ResourceUse::default();
    for id in parents.keys().copied().filter(|id| is_ours(*id)) {
        // A clock tick of user space is 1/100 s on every Linux.
        all.cpu_s += ticks.get(&id).copied().unwrap_or(0) as f64 / 100.0;
        let folder = Path::new("/proc").join(id.to_string());
        let command = std::fs::read(folder.join("cmdline")).unwrap_or_default();
        if String::from_utf8_lossy(&command).contains("--type=renderer") {
            all.page_bytes = all.page_bytes.max(resident(&folder));
        }
    }
    Some(all)
}

/// Resident memory of a process, bytes.
fn resident(folder: &Path) -> u64 {
    let status = std::fs::read_to_string(folder.join("status")).unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kilobytes = line.and_then(|line| line.trim().split(' ').next()?.parse::<u64>().ok());
    kilobytes.unwrap_or(0) * 1024
}
