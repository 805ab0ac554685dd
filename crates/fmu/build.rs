//! The shared library goes into every FMU: without what only a debugger reads it has a tenth of the size.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let os = std::env::var("CARGO_CFG_TARGET_OS").unwrap_or_default();
    if os == "linux" {
        println!("cargo::rustc-link-arg-cdylib=-Wl,--strip-all");
    } else if os == "macos" {
        println!("cargo::rustc-link-arg-cdylib=-Wl,-S");
    }
}
