//! libFuzzer over one parser, which the variable `SIGHTLINE_FUZZ_TARGET` names.

#![no_main]

use std::sync::OnceLock;

use sightline_fuzz::{TARGETS, Target, target};

libfuzzer_sys::fuzz_target!(init: catch_panics(), |bytes: &[u8]| {
    static CHOSEN: OnceLock<&Target> = OnceLock::new();
    (CHOSEN.get_or_init(chosen).parse)(bytes);
});

/// Lets panics of the database unwind: libFuzzer's panic hook aborts the process, but the program catches these panics.
fn catch_panics() {
    if chosen().name == "store" {
        drop(std::panic::take_hook());
    }
}

fn chosen() -> &'static Target {
    let name = std::env::var("SIGHTLINE_FUZZ_TARGET").unwrap_or_default();
    let names: Vec<_> = TARGETS.iter().map(|target| target.name).collect();
    target(&name).unwrap_or_else(|| panic!("SIGHTLINE_FUZZ_TARGET must be one of {}", names.join(", ")))
}
