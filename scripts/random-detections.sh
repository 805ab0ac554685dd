#!/usr/bin/env bash
# Random detections over all methods, motors, sensors, errors, faults and keys: each must end with an outcome or a named error.
#   scripts/random-detections.sh N [SEED]      N detections, from this seed on (0 without it)
# Counts are kept in target/random-detections/SEED.txt: an interrupted run goes on where it was. A surprise is printed with the
# command that repeats it, and makes the script fail. THREADS (1) says how many threads compute.
set -euo pipefail
cd "$(dirname "$0")/.."
detections=${1:?how many detections?}
seed=${2:-0}
out="${CARGO_TARGET_DIR:-target}/random-detections"
mkdir -p "$out"
nice -n 19 cargo run --release --quiet --example random_detections -- \
    "$detections" --seed "$seed" --threads "${THREADS:-1}" --keep "$out/$seed.txt"
