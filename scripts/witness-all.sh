#!/usr/bin/env bash
# Holds the project to what others published, as far as that takes minutes: reliability problems,
# NIST's certified statistics, sensitivities, searches, and what `standstill witness` computes anew. What each part printed is kept.
#   scripts/witness-all.sh            into target/witness
#   scripts/witness-all.sh FOLDER     into another folder
# With `pip install numpy scipy openturns otbenchmark` (PYTHON names the interpreter) the other programs run beside ours.
set -uo pipefail
cd "$(dirname "$0")/.."
out=$(realpath -m "${1:-${CARGO_TARGET_DIR:-target}/witness}")
python=${PYTHON:-python3}
mkdir -p "$out"
failed=()
left_out=()

part() {
    local name=$1
    shift
    printf '\n== %s\n' "$name"
    if ! "$@" 2>&1 | tee "$out/$name.txt"; then failed+=("$name"); fi
}
other() {
    local name=$1 module=$2
    shift 2
    if "$python" -c "import $module" 2>/dev/null; then part "$name" "$python" "$@"; else left_out+=("$name ($module)"); fi
}

part program cargo run --release --quiet -- witness
part nist cargo test --release --quiet -p standstill-campaign --test nist
part odds cargo test --release --quiet -p standstill-odds --test closed_forms reliability -- --nocapture
part problems cargo run --release --quiet -p standstill-odds --features measure --example coverage -- 100 problems quick
part searches cargo test --release --quiet -p standstill-analysis --test witness -- --nocapture
other cobyla scipy tests/cross/optimiser/cobyla.py
other borehole scipy tests/cross/sensitivity/borehole.py
other references scipy tests/cross/reliability/references.py
other openturns otbenchmark tests/cross/reliability/openturns_subset.py 30

printf '\nOutput: %s\n' "$out"
((${#left_out[@]} == 0)) || printf 'left out: %s\n' "${left_out[@]}"
((${#failed[@]} == 0)) || { printf 'FAILED: %s\n' "${failed[@]}"; exit 1; }
