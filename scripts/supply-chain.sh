#!/usr/bin/env bash
# What comes from others, in this workspace and in the three beside it, by the rules of deny.toml: known faults and crates that were given up
# (RustSec's advisories), licences, crates in two versions, sources. Needs cargo-deny (`cargo install cargo-deny --locked`) and, for the advisories,
# the network: `scripts/supply-chain.sh licenses bans sources` does without.
set -euo pipefail
cd "$(dirname "$0")/.."

cargo deny --version >/dev/null 2>&1 || { echo "cargo-deny is needed: cargo install cargo-deny --locked" >&2; exit 2; }
parts=("$@")
check() {
    local manifest=$1
    shift
    printf '\n== %s\n' "$manifest"
    cargo deny --locked --workspace --manifest-path "$manifest" "$@" ${parts[@]+"${parts[@]}"}
}
check Cargo.toml check
# Exceptions for duplicates are the first workspace's; not each of the others has them.
check crates/python/Cargo.toml check --allow unmatched-skip
check crates/firmware/Cargo.toml check --allow unmatched-skip
check crates/lab/wasm/Cargo.toml --target wasm32-unknown-unknown check --allow unmatched-skip
