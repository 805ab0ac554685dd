//! The shared library goes into every FMU: without what only a debugger reads it has a tenth of the size.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let os = std::env::var("CARGO_CFG_TARGET_OS").unwrap_or_default();
    let gnu = std::env::var("CARGO_CFG_TARGET_ENV").is_ok_and(|env| env == "gnu");
    if os == "linux" || os == "windows" && gnu {
        println!("cargo::rustc-link-arg-cdylib=-Wl,--strip-all");
    } else if os == "macos" {
        println!("cargo::rustc-link-arg-cdylib=-Wl,-S");
    }
}
