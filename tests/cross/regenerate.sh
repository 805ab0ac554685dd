#!/usr/bin/env bash
# Runs the netlists of this folder with ngspice (Debian: apt-get install ngspice) and writes the golden CSV files
# that the tests compare with: time in s, phase currents in A, every 20 µs.
set -euo pipefail
cd "$(dirname "$0")"
for netlist in *.cir; do
    name=${netlist%.cir}
    # In batch mode ngspice counts an analysis from a control block as none and exits with 1: the data tell.
    ngspice -b "$netlist" >"$name.log" 2>&1 || true
    [ -s "$name.data" ] || { cat "$name.log"; exit 1; }
    { echo "t_s,i_a_A,i_b_A,i_c_A"; awk '$1 ~ /^[ ]*[0-9]/ { printf "%.6e,%.8e,%.8e,%.8e\n", $1, $2, $3, $4 }' "$name.data"; } >"$name.csv"
    rm -f "$name.data" "$name.log"
done
