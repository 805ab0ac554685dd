#!/usr/bin/env bash
# What `cargo test` leaves out because it needs more than Rust: Python, importers of FMUs, clusters (and whatever else
# another language reads), the commands with which the pages for them begin, the lab in a browser, and tests that only widen others
# (`#[ignore]`). Makes a virtual environment of its own, runs each part, and says what it could not find.
#   scripts/test-all.sh            all parts
#   scripts/test-all.sh python     one of them: c, python, fmu, cluster, lab, long
#   scripts/test-all.sh faults     of `long` what kills commands and lets disks fail, with its counts
#   STRICT=1 scripts/test-all.sh lab   on an idle machine: the lab's times by the clock must be those that docs/lab.md promises
set -uo pipefail
cd "$(dirname "$0")/.."
parts=${*:-c python fmu cluster lab long}
target=$(realpath -m "${CARGO_TARGET_DIR:-target}")
venv=$target/venv
left_out=()
failed=()

say() { printf '\n== %s\n' "$*"; }
missing() { left_out+=("$1"); printf 'left out: %s\n' "$1"; }
try() {
    "$@"
    local code=$?
    if [ "$code" = 77 ]; then missing "$*"; elif [ "$code" != 0 ]; then failed+=("$*"); fi
}

say "program"
[ "$parts" = faults ] || cargo build --release --bin standstill || exit 1
export STANDSTILL=$target/release/standstill

environment() {
    [ -x "$venv/bin/python" ] && return
    command -v python3 >/dev/null || return 1
    python3 -m venv "$venv" && "$venv/bin/pip" install --quiet --upgrade pip
}

wheel() {
    "$venv/bin/pip" install --quiet 'maturin>=1.9,<2' || return 1
    # Built in a folder of its own target, because the crate is a workspace of its own.
    CARGO_TARGET_DIR=$target/python "$venv/bin/maturin" build --release --quiet \
        --manifest-path crates/python/Cargo.toml --interpreter "$venv/bin/python" --out "$target/wheels" || return 1
    local newest
    newest=$(ls -t "$target"/wheels/standstill-*.whl | head -1)
    local size
    size=$(stat -c %s "$newest")
    printf 'wheel: %s, %d bytes\n' "$(basename "$newest")" "$size"
    [ "$size" -le 5200000 ] || failed+=("a wheel of at most 5.2 MB")
    "$venv/bin/pip" install --quiet --force-reinstall --no-deps "$newest" || return 1
    "$venv/bin/pip" install --quiet numpy pandas pyarrow polars scipy mypy pytest matplotlib nbclient ipykernel 'dask[distributed]'
}

python_part() {
    try "$venv/bin/python" -m pytest -q crates/python/tests
    try inside_the_wheel
    (cd "$target" && exec "$venv/bin/python" -m pytest -q --doctest-modules --pyargs standstill) || failed+=("doctests")
    try "$venv/bin/mypy" --strict -p standstill
    try "$venv/bin/mypy" --strict --allow-untyped-defs --allow-untyped-calls examples/python/error_over_angle.py
    try "$venv/bin/python" examples/python/error_over_angle.py "$target/error_over_angle.png"
    try "$venv/bin/python" tests/python/read_results.py "$STANDSTILL"
    try "$venv/bin/python" tests/python/costs.py "$STANDSTILL"
    try page python
}

# What an installer and a type checker look for in the wheel.
inside_the_wheel() {
    local newest listed name
    newest=$(ls -t "$target"/wheels/standstill-*.whl | head -1)
    listed=$("$venv/bin/python" -m zipfile -l "$newest")
    for name in licenses/LICENSE-MIT licenses/LICENSE-APACHE licenses/THIRD-PARTY.md standstill/py.typed standstill/_standstill.pyi METADATA; do
        grep -q "$name" <<<"$listed" || { echo "the wheel has no $name" >&2; return 1; }
    done
    "$venv/bin/python" - "$newest" <<'PY'
import email, sys, zipfile
archive = zipfile.ZipFile(sys.argv[1])
(name,) = [name for name in archive.namelist() if name.endswith(".dist-info/METADATA")]
metadata = email.message_from_bytes(archive.read(name))
assert metadata["License-Expression"] == "MIT OR Apache-2.0", metadata["License-Expression"]
assert "Typing :: Typed" in metadata.get_all("Classifier"), metadata.get_all("Classifier")
for licence in ("LICENSE-MIT", "LICENSE-APACHE", "THIRD-PARTY.md"):
    (inside,) = [name for name in archive.namelist() if name.endswith("licenses/" + licence)]
    assert archive.read(inside) == open(licence, "rb").read(), f"{inside} is not the repository's"
PY
}

# The commands of a page as printed, with the programs that were built here.
page() {
    PATH=$venv/bin:$target/release:$PATH CARGO_TARGET_DIR=$target/python scripts/run-page.sh "docs/$1.md"
}

fmu_part() {
    if ! "$venv/bin/pip" install --quiet fmpy numpy; then missing "fmpy: importers of FMUs"; return; fi
    try scripts/fmu-binaries.sh --try
    "$venv/bin/pip" install --quiet libcosimpy || missing "libcosimpy: a second importer of FMUs"
    try "$venv/bin/python" tests/fmu/importers.py "$STANDSTILL"
    try page fmi
}

cluster_part() {
    try "$venv/bin/python" examples/python/dask_shards.py
    try tests/cluster/slurm.sh "$STANDSTILL"
}

# The headers without a warning, as older C and as C++ read them.
headers() {
    local flags=(-pedantic -Wall -Wextra -Werror -fsyntax-only -I crates/foreign/include -I crates/firmware/include)
    local header
    for header in standstill.h sts_detectors.h; do
        cc -x c -std=c99 "${flags[@]}" - <<<"#include \"$header\"" || return 1
        if ! command -v c++ >/dev/null; then return 77; fi
        c++ -x c++ -std=c++17 "${flags[@]}" - <<<"#include \"$header\"" || return 1
    done
    echo "standstill.h and sts_detectors.h: read by C99 and C++17 without a warning"
}

# The detectors as a C library, and the drive in C that replays a recorded detection with them.
drive() {
    scripts/detectors-c.sh "$target/detectors-c" || return 1
    cc -std=c99 -O2 -I "$target/detectors-c" -o "$target/replay" examples/c/drive/main.c \
        "$target/detectors-c/host/libsts_detectors.a" && "$target/replay"
}

c_part() {
    if ! command -v cc >/dev/null; then missing "cc: detectors in C"; return; fi
    try headers
    try drive
    try page own-detector
}

# A page with each kind of chart and table, as its readers use it.
gallery() {
    cargo run --release -p standstill-report --example gallery "$target/pictures/gallery" \
        && node tests/pages/check.mjs "$target/pictures/gallery/page.html" "$target/pictures/page"
}

# The lab in a headless Chromium, from its server and, where the target for WebAssembly is there, without one.
lab_part() {
    local chromium=${CHROMIUM:-/usr/bin/chromium}
    if ! command -v npm >/dev/null || [ ! -x "$chromium" ]; then missing "npm and $chromium: the lab in a browser"; return; fi
    (cd tests/pages && npm ci --silent) || { failed+=("npm ci in tests/pages"); return; }
    try gallery
    try node tests/pages/lab.mjs "$STANDSTILL" "$target/pictures/lab"
    if scripts/lab-static.sh "$target/site"; then
        try node tests/pages/lab.mjs static "$target/site" "$target/pictures/static" "$STANDSTILL"
    else
        missing "the target wasm32-unknown-unknown: the lab without a server"
        return
    fi
    if ! command -v mdbook >/dev/null; then missing "mdbook (cargo install mdbook --locked): the site"; return; fi
    try scripts/site.sh "$target/pages" --without-rustdoc --version tried
    try node tests/pages/site.mjs "$target/pages" "$target/pictures/pages"
}

case " $parts " in *" python "* | *" cluster "* | *" fmu "*)
    if ! environment; then
        missing "python3 with venv: the parts python, fmu and cluster"
        parts=${parts//python/} parts=${parts//cluster/} parts=${parts//fmu/}
    fi
    ;;
esac
case " $parts " in *" python "* | *" cluster "*)
    say "Python"
    if ! wheel; then
        failed+=("the wheel")
        parts=${parts//python/} parts=${parts//cluster/}
    fi
    ;;
esac
case " $parts " in *" python "*) python_part ;; esac
case " $parts " in *" fmu "*) say "FMUs"; fmu_part ;; esac
case " $parts " in *" cluster "*) say "clusters"; cluster_part ;; esac
case " $parts " in *" c "*)
    say "C and C++"
    c_part
    ;;
esac

case " $parts " in *" lab "*) say "the lab"; lab_part ;; esac
# Kills, full disks and their kind, each command: the counts that docs/validation.md has.
faults() {
    cargo test -p standstill --test cli broken:: -- --include-ignored --nocapture 2>&1 | grep -E 'killed|calls failed|panicked|error|test result'
}

# From published sheets to verdict, fresh starts and next command; where nothing suits, an exhaustive search must find nothing either.
ten_motors() {
    cargo run --release --example ten_motors -- 2000
}

case " $parts " in *" faults "*) say "faults"; try faults ;; esac
case " $parts " in *" long "*) say "ten motors"; try ten_motors ;; esac
case " $parts " in *" long "*) say "tests that widen others"; try cargo test --workspace --lib --tests -- --ignored ;; esac

say "summary"
for part in "${left_out[@]}"; do echo "left out: $part"; done
for part in "${failed[@]}"; do echo "FAILED: $part"; done
[ ${#failed[@]} = 0 ] && echo "all that was tried holds"
