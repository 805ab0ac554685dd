#!/usr/bin/env bash
# Holds the project to what others published, in at most half an hour: what `standstill witness` computes anew, NIST's certified
# statistics, reliability problems, sensitivities, searches, independent circuits (ngspice, SciPy), known traces. What each part printed is
# kept, and its time; a part that takes longer than what is left of the half hour fails.
#   scripts/witness-all.sh            into target/witness
#   scripts/witness-all.sh FOLDER     into another folder
# With `pip install numpy scipy openturns otbenchmark` (PYTHON names the interpreter) the other programs run beside ours. SEEDS: answers for
# each reliability problem (10).
set -uo pipefail
cd "$(dirname "$0")/.."
out=$(realpath -m "${1:-${CARGO_TARGET_DIR:-target}/witness}")
python=${PYTHON:-python3}
most=1800
mkdir -p "$out"
failed=()
left_out=()
times=()

part() {
    local name=$1 begun=$SECONDS
    shift
    printf '\n== %s\n' "$name"
    if ! timeout $((most > SECONDS ? most - SECONDS : 1)) "$@" 2>&1 | tee "$out/$name.txt"; then failed+=("$name"); fi
    times+=("$name $((SECONDS - begun))")
}
other() {
    local name=$1 module=$2
    shift 2
    if "$python" -c "import $module" 2>/dev/null; then part "$name" "$python" "$@"; else left_out+=("$name ($module)"); fi
}

# Building is not counted.
cargo build --release --quiet
cargo test --release --quiet --no-run -p standstill-campaign -p standstill-odds -p standstill-analysis -p standstill
cargo test --release --quiet --no-run --test suite
cargo build --release --quiet -p standstill-odds --features measure --example coverage
SECONDS=0
part program cargo run --release --quiet -- witness
part circuits cargo test --release --quiet --test suite cross_
part bounds cargo test --release --quiet -p standstill-analysis --lib reaches_the_bound
part nist cargo test --release --quiet -p standstill-campaign --test nist
part odds cargo test --release --quiet -p standstill-odds --test closed_forms reliability -- --nocapture
part searches cargo test --release --quiet -p standstill-analysis --test witness -- --nocapture
part traces cargo test --release --quiet -p standstill --test cli known_traces -- --include-ignored
other cobyla scipy tests/cross/optimiser/cobyla.py
other borehole scipy tests/cross/sensitivity/borehole.py
other references scipy tests/cross/reliability/references.py
other openturns otbenchmark tests/cross/reliability/openturns_subset.py 10
part problems cargo run --release --quiet -p standstill-odds --features measure --example coverage -- "${SEEDS:-10}" problems quick

{
    printf '%s, numerics and ABI: %s\n' "$(date -u +%Y-%m-%d)" "$(cargo run --release --quiet -- --version)"
    printf 'seconds: %s\n' "${times[@]}"
    ((${#left_out[@]} == 0)) || printf 'left out: %s\n' "${left_out[@]}"
    ((${#failed[@]} == 0)) || printf 'FAILED: %s\n' "${failed[@]}"
} | tee "$out/summary.txt"
printf 'Output: %s\n' "$out"
((${#failed[@]} == 0))
