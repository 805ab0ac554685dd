#!/usr/bin/env bash
# Writes the netlists (netlists.py) and runs them with ngspice (Debian: apt-get install ngspice python3) into the golden
# CSV files that the tests compare with: time in s, phase currents in A, every 20 µs. With a number, that is the
# longest step in µs.
set -euo pipefail
cd "$(dirname "$0")"
python3 netlists.py "$@"
cd spice
for netlist in *.cir; do
    name=${netlist%.cir}
    # In batch mode ngspice counts an analysis from a control block as none and exits with 1: the data tell.
    ngspice -b "$netlist" >"$name.log" 2>&1 || true
    if ! [ -s "$name.data" ] || grep -q "aborted" "$name.log"; then cat "$name.log"; exit 1; fi
    { echo "t_s,i_a_A,i_b_A,i_c_A"; awk '$1 ~ /^[ ]*[0-9]/ { printf "%.6g,%.7g,%.7g,%.7g\n", $1, $2, $3, $4 }' "$name.data"; } >"$name.csv"
    rm -f "$name.data" "$name.log"
done
