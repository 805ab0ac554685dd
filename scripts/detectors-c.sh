#!/usr/bin/env bash
# The detectors as a static C library, libsts_detectors.a, for this machine and for Cortex-M4F and M7 (thumbv7em-none-eabihf),
# with its headers, in a folder.
#
#     scripts/detectors-c.sh FOLDER
#
# The target for microcontrollers comes with `rustup target add thumbv7em-none-eabihf`; where it cannot be had, this says so and
# leaves that part out.
set -euo pipefail
out=${1:?usage: scripts/detectors-c.sh FOLDER}
mkdir -p "$out/host"
out=$(cd "$out" && pwd)
cd "$(dirname "$0")/.."
target=${CARGO_TARGET_DIR:-target}/firmware
chip=thumbv7em-none-eabihf
build() { cargo build --release --locked --manifest-path crates/firmware/Cargo.toml --target-dir "$target" "$@"; }

cp crates/foreign/include/standstill.h crates/firmware/include/sts_detectors.h "$out/"
build
cp "$target/release/libsts_detectors.a" "$out/host/"
echo "host: $out/host/libsts_detectors.a"

has_chip() { [ -d "$(rustc --print target-libdir --target "$chip" 2>/dev/null)" ]; }
if ! has_chip && command -v rustup >/dev/null; then
    rustup target add "$chip" || true
fi
if ! has_chip; then
    echo "left out: $chip, which is not installed and which rustup could not get (rustup target add $chip)"
    exit 0
fi
build --target "$chip"
mkdir -p "$out/$chip"
cp "$target/$chip/release/libsts_detectors.a" "$out/$chip/"
echo "$chip: $out/$chip/libsts_detectors.a"

# What of it a drive's linker keeps, and that nothing is missing: the linker that comes with Rust, if it is there.
linker=$(rustc --print sysroot)/lib/rustlib/$(rustc -vV | sed -n 's/^host: //p')/bin/rust-lld
if [ -x "$linker" ]; then
    "$linker" -flavor gnu --gc-sections -e sts_step -u sts_begin "$out/$chip/libsts_detectors.a" -o "$target/linked.elf"
    if command -v size >/dev/null; then
        echo "$chip: all methods together take $(size "$target/linked.elf" | awk 'NR == 2 { print $1 }') bytes of flash"
    fi
fi
