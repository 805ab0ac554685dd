//! Results on other machines.

use std::fs;
use std::process::Command;

use crate::folder;

/// Three of its rows differed when sines were the C library's.
const SCENARIO: &str = r#"
motor = "slot-harmonics"
errors = "none"
trials = 100
seed = 1
[rotor]
state = "free"
[sensors]
bandwidth = "50 kHz"
[detector]
method = "hfi-rotating"
"#;

/// A processor without fused multiplication gets other sines and logarithms from the C library. This setting makes glibc
/// choose them here; elsewhere it does nothing.
/// promise: bits-processors
#[test]
fn law_results_do_not_depend_on_which_sines_the_c_library_has() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("s.toml"), SCENARIO).expect("written");
    let run = |out: &str, features: &str| {
        let status = Command::new(env!("CARGO_BIN_EXE_standstill"))
            .args(["run", "s.toml", "--out", out])
            .env("GLIBC_TUNABLES", format!("glibc.cpu.hwcaps={features}"))
            .current_dir(at)
            .output()
            .expect("the program starts")
            .status;
        assert!(status.success());
        ["trials.csv", "summary.json"]
            .map(|name| fs::read_to_string(at.join(out).join(name)).expect("written"))
    };
    let [own, other] = [run("own", ""), run("other", "-FMA,-FMA4,-AVX2,-AVX512F")];
    for (own, other) in own.iter().zip(&other) {
        let differing = own.lines().zip(other.lines()).find(|(own, other)| own != other);
        assert_eq!(differing, None);
        assert_eq!(own.lines().count(), other.lines().count());
    }
}
