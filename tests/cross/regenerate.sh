#!/usr/bin/env bash
# Writes the netlists of ngspice/cases.txt and runs them (Debian: apt-get install ngspice): golden CSV files with time
# in s and phase currents in A, which the tests compare with. With --own-error, nothing is overwritten: all cases run
# again at half the maximum step, then at a tenth of the tolerance, and the largest differences are printed.
set -euo pipefail
cd "$(dirname "$0")"

# Runs the netlists of a folder.
simulate() {
    local netlist name
    for netlist in "$1"/*.cir; do
        name=$(basename "$netlist" .cir)
        # ngspice's exit code says nothing about an analysis from a control block, and one that was given up still
        # writes data: the log tells.
        (cd "$1" && rm -f "$name.data" && ngspice -b "$name.cir" >"$name.log" 2>&1) || true
        if [ ! -s "$1/$name.data" ] || grep -qi -e aborted -e error -e 'too small' "$1/$name.log"; then
            cat "$1/$name.log" >&2
            echo "$name did not run to its end" >&2
            exit 1
        fi
        python3 netlists.py --csv "$1/$name.data" "$1/$name.csv"
        rm -f "$1/$name.data" "$1/$name.log"
    done
}

if [ "${1:-}" = --own-error ]; then
    scratch=$(mktemp -d)
    trap 'rm -rf "$scratch"' EXIT
    for refinement in "--step 0.05" "--reltol 1e-8"; do
        echo "with $refinement:"
        # Two words on purpose.
        # shellcheck disable=SC2086
        python3 netlists.py --into "$scratch" $refinement
        simulate "$scratch"
        python3 netlists.py --compare "$scratch"
    done
else
    rm -f ngspice/*.cir ngspice/*.csv
    python3 netlists.py
    simulate ngspice
fi
