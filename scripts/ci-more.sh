#!/usr/bin/env bash
# What must hold beside .ci/run, takes long, and seldom breaks alone: the command line's library as Python's package has it, the oldest
# compiler, detectors in C, the lab without a server, packages, the gallery, code for wide registers. What cannot be had here is left out, and said.
#   scripts/ci-more.sh              all parts
#   scripts/ci-more.sh oldest c     some of them: python, oldest, c, lab, packages, gallery, wide
set -euo pipefail
cd "$(dirname "$0")/.."
case ${CARGO_TARGET_DIR:=target} in /*) ;; *) CARGO_TARGET_DIR=$PWD/$CARGO_TARGET_DIR ;; esac
export CARGO_TARGET_DIR
all='python oldest c lab packages gallery wide'
left_out=()

say() { printf '\n== %s (after %d s)\n' "$*" "$SECONDS"; }
missing() { left_out+=("$1"); echo "left out: $1"; }

for part in ${*:-$all}; do
    case $part in
        python)
            say "the commands as Python's package has them"
            cargo clippy --locked -p standstill --no-default-features --lib -- -D warnings
            ;;
        oldest)
            oldest=$(sed -n 's/^rust-version = "\(.*\)"$/\1/p' Cargo.toml)
            say "the oldest compiler, Rust $oldest"
            if rustup toolchain install "$oldest" --profile minimal --no-self-update >/dev/null 2>&1; then
                cargo "+$oldest" check --locked --workspace --target-dir "$CARGO_TARGET_DIR/oldest"
            else
                missing "Rust $oldest, which rustup cannot get here"
            fi
            ;;
        c)
            say "detectors as a C library: neither standard library nor allocator"
            scripts/detectors-c.sh "$CARGO_TARGET_DIR/detectors-c"
            ;;
        lab)
            say "the lab without a server"
            if rustup target add wasm32-unknown-unknown >/dev/null 2>&1; then
                folder=$(mktemp -d)
                scripts/lab-static.sh "$folder"
                rm -rf "$folder"
            else
                missing "the target wasm32-unknown-unknown, which rustup cannot get here"
            fi
            ;;
        packages)
            say "packages as a registry would get them"
            cargo package --locked --workspace --exclude standstill-workspace --no-verify --allow-dirty --quiet
            ;;
        gallery)
            say "gallery of the figures and pages"
            folder=$(mktemp -d)
            cargo run --release --quiet -p standstill-report --example gallery -- "$folder" >/dev/null
            rm -rf "$folder"
            cargo build --release --quiet --bin standstill
            scripts/gallery.py "$CARGO_TARGET_DIR/release/standstill"
            ;;
        wide)
            say "code for wide registers"
            cargo build --release --quiet -p standstill-sim
            scripts/wide-code.sh "$CARGO_TARGET_DIR/release/libstandstill_sim.rlib"
            ;;
        *)
            echo "ci-more.sh: no part \"$part\"; there are: $all" >&2
            exit 2
            ;;
    esac
done

say summary
for part in ${left_out[@]+"${left_out[@]}"}; do echo "left out: $part"; done
echo "all that was tried holds"
# STRICT=1: what is left out is a failure.
[ -z "${STRICT:-}" ] || [ ${#left_out[@]} = 0 ]
