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
# All of it is asked for at once, and the engine first.
links='<link rel="preload" href="engine.wasm" as="fetch" type="application/wasm" crossorigin>'
for module in engine.mjs decode.mjs $(cd crates/lab/page && ls ./*.mjs | grep -vE '/(engine|decode|server|main)\.mjs'); do
    links+="<link rel=\"modulepreload\" href=\"${module#./}\">"
done
sed -i "s#<script type=\"module\" src=\"main.mjs\">#$links<script type=\"module\" src=\"engine.mjs\"></script>\n&#" "$out/index.html"
grep -q 'src="engine.mjs"' "$out/index.html" || { echo "lab-static.sh: index.html has no line of main.mjs" >&2; exit 1; }
cp "${CARGO_TARGET_DIR:-target}/wasm/wasm32-unknown-unknown/release/standstill_lab_wasm.wasm" "$out/engine.wasm"
du -h "$out/engine.wasm" | cut -f1 | sed "s/^/engine.wasm has /"
