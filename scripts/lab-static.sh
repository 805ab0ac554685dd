#!/usr/bin/env bash
# The lab as a static folder: the same page with the engine in a worker of the browser, for any web space.
#
#     scripts/lab-static.sh FOLDER
#
# Needs the target wasm32-unknown-unknown: `rustup target add wasm32-unknown-unknown`. Modules and workers are not loaded from
# file://, so look at it through a server, such as `python3 -m http.server --directory FOLDER`.
set -euo pipefail
out=${1:?usage: scripts/lab-static.sh FOLDER}
mkdir -p "$out"
out=$(cd "$out" && pwd)
cd "$(dirname "$0")/.."
if ! rustc --print target-libdir --target wasm32-unknown-unknown >/dev/null 2>&1 \
    || [ ! -d "$(rustc --print target-libdir --target wasm32-unknown-unknown)" ]; then
    echo "the target is missing: rustup target add wasm32-unknown-unknown" >&2
    exit 2
fi
cargo build --release --locked --manifest-path crates/lab/wasm/Cargo.toml --target wasm32-unknown-unknown \
    --target-dir "${CARGO_TARGET_DIR:-target}/wasm"
cp crates/lab/page/* "$out/"
cp crates/lab/wasm/engine.mjs crates/lab/wasm/worker.mjs "$out/"
rm "$out/server.mjs"
cp "${CARGO_TARGET_DIR:-target}/wasm/wasm32-unknown-unknown/release/standstill_lab_wasm.wasm" "$out/engine.wasm"
du -h "$out/engine.wasm" | cut -f1 | sed "s/^/engine.wasm has /"
