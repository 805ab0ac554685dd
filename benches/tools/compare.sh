#!/usr/bin/env bash
# Standstill beside ngspice, SciPy, gym-electric-motor and a loop of fixed steps in C on one problem: installs them into a folder of
# its own, runs all by turns on one core, prints a table and writes it there as comparison.md and comparison.csv.
#
#   compare.sh [FOLDER]      default: target/tools in the repository; a second run uses what is there
#
#   NGSPICE=PATH             this ngspice; NGSPICE=download: Debian's, even if there is one on the PATH
#   ROUNDS=N                 how often everything runs, 3 by default; each keeps its best
#   CORE=N                   the core that everything runs on
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
repository=$(cd "$here/../.." && pwd)
mkdir -p "${1:-$repository/target/tools}"
folder=$(cd "${1:-$repository/target/tools}" && pwd)

fail() { printf 'compare.sh: %s\n' "$*" >&2; exit 1; }
say() { printf '== %s\n' "$*" >&2; }
need() { command -v "$1" >/dev/null || fail "$1 is missing: $2"; }

need cargo "see README.md"
need python3 "3.11 or later, with venv (Debian: python3-venv)"
need cc "a C compiler for the loop of fixed steps"

# Debian's package and the libraries that are not on this machine, unpacked without root.
download_ngspice() {
    local root=$folder/ngspice package packages
    if [ ! -x "$root/usr/bin/ngspice" ]; then
        need apt-get "no ngspice found and this is no Debian; install it, or give its path as NGSPICE"
        need apt-cache "no ngspice found and this is no Debian"
        say "downloading ngspice into $root"
        packages=$(apt-cache depends --recurse --no-recommends --no-suggests --no-conflicts --no-breaks \
            --no-replaces --no-enhances ngspice | grep -E '^(lib|ngspice$)' | sort -u) || packages=
        [ -n "$packages" ] || fail "apt knows no ngspice: 'apt-get update' as root, or give its path as NGSPICE"
        mkdir -p "$folder/packages" "$root"
        for package in $packages; do
            if [ "$package" = ngspice ] || ! dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null | grep -qx installed; then
                (cd "$folder/packages" && apt-get download "$package" >"$folder/apt.log" 2>&1) \
                    || fail "apt-get could not download $package, see $folder/apt.log"
            fi
        done
        for package in "$folder/packages"/*.deb; do dpkg -x "$package" "$root"; done
    fi
    libraries=$(find "$root" -name '*.so*' -printf '%h\n' | sort -u | paste -sd:)
    export LD_LIBRARY_PATH="$libraries${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}"
    export SPICE_LIB_DIR=$root/usr/share/ngspice
    ngspice=$root/usr/bin/ngspice
}

ngspice=${NGSPICE:-$(command -v ngspice || echo download)}
if [ "$ngspice" = download ]; then download_ngspice; fi
"$ngspice" --version >/dev/null 2>&1 || fail "$ngspice does not start"

venv=$folder/venv
if ! cmp -s "$here/requirements.txt" "$venv/installed.txt"; then
    say "installing SciPy and gym-electric-motor into $venv"
    python3 -m venv --clear "$venv" || fail "no virtual environment (Debian: apt-get install python3-venv)"
    "$venv/bin/pip" install --quiet --disable-pip-version-check -r "$here/requirements.txt" \
        || fail "pip could not install what requirements.txt names"
    cp "$here/requirements.txt" "$venv/installed.txt"
fi

say "building Standstill"
target=${CARGO_TARGET_DIR:-$repository/target}
cargo build --release --quiet --manifest-path "$repository/Cargo.toml" --example three_pulses

cc -O3 -march=native -std=c11 -D_POSIX_C_SOURCE=199309L "$here/fixed_step.c" -o "$folder/fixed_step" -lm \
    || fail "fixed_step.c does not compile"

# One thread on one core each, and nothing else at the same time from here.
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1 PYTHONDONTWRITEBYTECODE=1
pin=()
if command -v taskset >/dev/null; then
    pin=(taskset -c "${CORE:-$(taskset -cp $$ | sed 's/.*[ ,-]//')}")
fi
work=$folder/run
mkdir -p "$work"
: >"$work/lines.csv"
for round in $(seq "${ROUNDS:-3}"); do
    say "round $round"
    "${pin[@]}" "$target/release/examples/three_pulses" --csv >>"$work/lines.csv" || fail "Standstill failed"
    "${pin[@]}" "$folder/fixed_step" <"$here/reference.csv" >>"$work/lines.csv" || fail "the loop in C failed"
    "${pin[@]}" "$venv/bin/python" "$here/ngspice_pulses.py" "$ngspice" "$work" >>"$work/lines.csv" || fail "ngspice failed"
    "${pin[@]}" "$venv/bin/python" "$here/scipy_hybrid.py" >>"$work/lines.csv" || fail "SciPy failed"
    "${pin[@]}" "$venv/bin/python" "$here/gem_pulses.py" 1 >>"$work/lines.csv" || fail "gym-electric-motor failed"
done
"$venv/bin/python" "$here/table.py" "$work/lines.csv" "$folder"
