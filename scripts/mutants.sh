#!/usr/bin/env bash
# How many faults put into a crate by hand its tests notice: scripts/mutants.sh CRATE [COUNT] [SEED], such as `scripts/mutants.sh inverter 60 1`.
#
# A seeded sample of the mutants that cargo-mutants (`cargo install cargo-mutants --locked`) makes of `crates/CRATE` meets the tests of the crate
# itself; those that survive meet the suite of the whole (`tests/suite`), which takes minutes for each. What is decided is kept in
# `target/mutants/CRATE`: an interrupted run goes on where it was, a larger COUNT adds to a smaller one, and a survivor is tried again, so that
# a test that was written against it shows. Ends with code 1 while less than nine tenths are caught. `OWN=1` leaves the suite out.
set -euo pipefail
cd "$(dirname "$0")/.."

crate=${1:?needed: a folder of crates/, such as inverter} count=${2:-60} seed=${3:-1}
[ -d "crates/$crate/src" ] || { echo "crates/$crate: no such crate; there are: $(ls crates | tr '\n' ' ')" >&2; exit 2; }
[[ $count =~ ^[1-9][0-9]*$ ]] || { echo "COUNT: found \"$count\", needed: a number of mutants from 1" >&2; exit 2; }
cargo mutants --version >/dev/null 2>&1 || { echo "cargo-mutants is needed: cargo install cargo-mutants --locked" >&2; exit 2; }

target=${CARGO_TARGET_DIR:-$PWD/target}
kept=$target/mutants/$crate
mkdir -p "$kept"
export CARGO_TARGET_DIR=$target/mutants/build

# In the order of a digest of seed and name, in which the lines of a source file play no part: the first 20 are among the first 60.
cargo mutants --list -p "standstill-$crate" | while read -r name; do
    printf '%s\t%s\n' "$(printf '%s %s' "$seed" "$(sed -E 's/:[0-9]+:[0-9]+:/:/' <<<"$name")" | sha256sum | cut -c1-16)" "$name"
done | sort | head -n "$count" | cut -f2 >"$kept/sample.txt"

# What cargo-mutants says of these mutants: STAGE FILE-OF-NAMES OPTIONS.
meet() {
    local stage=$1 names=$2 chosen=()
    shift 2
    mkdir -p "$kept/$stage"
    touch "$kept/$stage/unviable.txt"
    while read -r name; do
        chosen+=(--re "^$(sed 's/[][\.*^$+?(){}|]/\\&/g' <<<"$name")\$")
    done <"$names"
    [ ${#chosen[@]} -gt 0 ] || return 0
    # 2: some were missed; 3: some took too long. Both are answers.
    local code=0
    cargo mutants -p "standstill-$crate" --output "$kept/$stage" --iterate --no-shuffle --no-times --colors never \
        "$@" "${chosen[@]}" >>"$kept/$stage.log" 2>&1 || code=$?
    # What does not compile is later listed among what was caught before.
    cat "$kept/$stage/mutants.out/unviable.txt" >>"$kept/$stage/unviable.txt"
    case $code in 0 | 2 | 3) ;; *) tail -n 20 "$kept/$stage.log" >&2; exit "$code" ;; esac
}

# The names of the sample in one of the lists of a stage, without those that do not compile: STAGE LIST...
found() {
    local stage=$1 list
    shift
    for list in "$@"; do
        cat "$kept/$stage/mutants.out/$list.txt" 2>/dev/null || true
    done | sort -u | grep -Fxf "$kept/sample.txt" | grep -vFxf "$kept/$stage/unviable.txt" || true
}

meet own "$kept/sample.txt" --minimum-test-timeout 120
unviable=$(sort -u "$kept/own/unviable.txt" | grep -cFxf "$kept/sample.txt" || true)
own=$(found own caught previously_caught | wc -l)
late=$(found own timeout | wc -l)
found own missed >"$kept/survivors.txt"
suite=0
if [ -z "${OWN:-}" ]; then
    meet suite "$kept/survivors.txt" --test-package standstill-workspace --minimum-test-timeout 1200
    suite=$(found suite caught previously_caught | grep -cFxf "$kept/survivors.txt" || true)
    late=$((late + $(found suite timeout | wc -l)))
    found suite caught previously_caught timeout | grep -vFxf - "$kept/survivors.txt" >"$kept/missed.txt" || true
else
    cp "$kept/survivors.txt" "$kept/missed.txt"
fi
missed=$(wc -l <"$kept/missed.txt")

# Wilson's interval of the share that is caught, time-outs apart.
awk -v crate="$crate" -v own="$own" -v suite="$suite" -v missed="$missed" -v late="$late" -v unviable="$unviable" 'BEGIN {
    k = own + suite; n = k + missed; z = 1.96
    printf "%s: %d of %d viable mutants caught (%d by its own tests, %d by the suite), %d took too long, %d do not compile", crate, k, n, own, suite, late, unviable
    if (n > 0) {
        p = k / n; mid = (p + z * z / (2 * n)) / (1 + z * z / n); half = z / (1 + z * z / n) * sqrt(p * (1 - p) / n + z * z / (4 * n * n))
        printf "; %.0f %%, 95 %% interval %.0f to %.0f %%", 100 * p, 100 * (mid - half), 100 * (mid + half)
    }
    printf "\n"
    exit !(n > 0 && k >= 0.9 * n)
}' || code=$?
sed 's/^/missed: /' "$kept/missed.txt"
exit "${code:-0}"
