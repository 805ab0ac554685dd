//! The reader that `STANDSTILL_FUZZ` names, under libFuzzer.
#![no_main]

use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use standstill_fuzz::{TARGETS, Target, target};

static CHOSEN: LazyLock<Target> = LazyLock::new(|| {
    let name = std::env::var("STANDSTILL_FUZZ").unwrap_or_default();
    target(&name).unwrap_or_else(|| {
        let all: Vec<&str> = TARGETS.iter().map(|target| target.name).collect();
        panic!("STANDSTILL_FUZZ: found \"{name}\", needed one of {}", all.join(", "))
    })
});

fuzz_target!(|bytes: &[u8]| (CHOSEN.run)(bytes));
