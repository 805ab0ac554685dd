#!/usr/bin/env bash
# Installs pandas, pyarrow and polars into a folder of its own and reads results with them. Needs Python 3 and a network.
set -euo pipefail
cd "$(dirname "$0")/../.."
cargo build --release --bin standstill
folder=${TMPDIR:-/tmp}/standstill-python
[ -x "$folder/bin/python" ] || python3 -m venv "$folder"
"$folder/bin/pip" install --quiet pandas pyarrow polars
"$folder/bin/python" tests/python/read_results.py "${CARGO_TARGET_DIR:-target}/release/standstill"
