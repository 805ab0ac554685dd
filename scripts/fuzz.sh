#!/usr/bin/env bash
# Gives the readers of files, requests and calls any bytes, by libFuzzer: scripts/fuzz.sh [SECONDS] [TARGET...], such as
# `scripts/fuzz.sh 600 npz mat`; without targets all of them, one after the other. Needs a nightly compiler and cargo-fuzz
# (`cargo install cargo-fuzz --locked`).
#
# In target/fuzz/: TARGET.log, what libFuzzer said; corpus/TARGET, inputs that reached new code, with which the next run goes on;
# found/TARGET, inputs that broke a law or a limit (5 s, 1 GiB); rates.txt, a line a run. An input that was found goes into tests/fuzz/corpus/TARGET:
# `cargo test -p standstill-fuzz` runs it ever after. Ends with code 1 if one was found.
set -euo pipefail
cd "$(dirname "$0")/.."

seconds=${1:-60}
[[ $seconds =~ ^[1-9][0-9]*$ ]] || { echo "SECONDS: found \"$seconds\", needed: a whole number from 1" >&2; exit 2; }
all=$(ls tests/fuzz/corpus)
targets=${*:2}
for target in ${targets:=$all}; do
    [ -d "tests/fuzz/corpus/$target" ] || { echo "TARGET: found \"$target\", needed: one of" $all >&2; exit 2; }
done
cargo +nightly fuzz --version >/dev/null 2>&1 || { echo "needed: rustup toolchain install nightly, and cargo install cargo-fuzz --locked" >&2; exit 2; }

out=${CARGO_TARGET_DIR:-$PWD/target}/fuzz
mkdir -p "$out"
CARGO_TARGET_DIR=$out nice -n 10 cargo +nightly fuzz build --fuzz-dir fuzz any
host=$(rustc +nightly -vV | sed -n 's/^host: //p')

code=0
for target in $targets; do
    mkdir -p "$out/corpus/$target" "$out/found/$target"
    before=$(find "$out/found/$target" -type f | wc -l)
    STANDSTILL_FUZZ=$target nice -n 19 "$out/$host/release/any" "$out/corpus/$target" "tests/fuzz/corpus/$target" \
        -max_total_time="$seconds" -max_len=65536 -timeout=5 -rss_limit_mb=2048 -malloc_limit_mb=1024 \
        -artifact_prefix="$out/found/$target/" -print_final_stats=1 >"$out/$target.log" 2>&1 || true
    found=$(($(find "$out/found/$target" -type f | wc -l) - before))
    runs=$(sed -n 's/^stat::number_of_executed_units: *//p' "$out/$target.log")
    rate=$(sed -n 's/^stat::average_exec_per_sec: *//p' "$out/$target.log")
    memory=$(sed -n 's/^stat::peak_rss_mb: *//p' "$out/$target.log")
    # A run without these lines did not end by itself: it must not pass for a clean one.
    [ -n "$runs" ] && [ "$found" = 0 ] || code=1
    printf '%s: %s inputs in %s s, %s per second, %s MiB, %s found\n' \
        "$target" "${runs:-no count of}" "$seconds" "${rate:-?}" "${memory:-?}" "$found" | tee -a "$out/rates.txt"
done
[ "$code" = 0 ] || echo "the inputs that were found: $out/found; what was said: $out/TARGET.log" >&2
exit "$code"
