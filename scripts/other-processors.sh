#!/usr/bin/env bash
# The digests of all results, computed as other processors compute them: the promise "the same bits on any processor", tried.
#
#     scripts/other-processors.sh             each of those below
#     scripts/other-processors.sh nehalem     one of them
#
# nehalem: x86-64 without AVX; haswell: AVX2; aarch64: ARM of 64 bits. By emulation: Debian's packages qemu-user and, for aarch64,
# gcc-aarch64-linux-gnu, with `rustup target add aarch64-unknown-linux-gnu`. Some minutes each. What is missing here is said, and the
# code is then 77; a digest that differs ends it with 1. AVX-512 is no part of emulators: a machine that has it runs it in `cargo test`.
set -euo pipefail
cd "$(dirname "$0")/.."
target=$(realpath -m "${CARGO_TARGET_DIR:-target}")
wanted=${*:-nehalem haswell aarch64}
failed=() missing=()

# The test program for a target, built and named by Cargo.
program() {
    cargo test --locked --quiet -p standstill-campaign --test numerics --no-run --message-format json "$@" |
        python3 -c '
import json, sys
found = [of["executable"] for line in sys.stdin if (of := json.loads(line)).get("executable") and of["target"]["name"] == "numerics"]
print(found[-1])'
}

# Runs the digests on an emulated processor. They look for their files beside their crate.
digests() {
    local name=$1
    shift
    echo "== $name"
    if (cd crates/campaign && CARGO_MANIFEST_DIR=$PWD "$@" --test-threads=1 2>&1 | grep -v '^qemu.*warning'); then
        echo "$name: the same digests"
    else
        failed+=("$name")
    fi
}

for of in $wanted; do
    case $of in
        nehalem | haswell)
            if [ "$(uname -m)" != x86_64 ] || ! command -v qemu-x86_64 >/dev/null; then
                missing+=("$of: x86-64 and qemu-user")
                continue
            fi
            case $of in nehalem) cpu=Nehalem ;; *) cpu=Haswell ;; esac
            digests "$of" qemu-x86_64 -cpu "$cpu" "$(program)"
            ;;
        aarch64)
            if ! command -v qemu-aarch64 >/dev/null || ! command -v aarch64-linux-gnu-gcc >/dev/null ||
                [ ! -d "$(rustc --print target-libdir --target aarch64-unknown-linux-gnu)" ]; then
                missing+=("aarch64: qemu-user, gcc-aarch64-linux-gnu, rustup target add aarch64-unknown-linux-gnu")
                continue
            fi
            built=$(CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc CARGO_TARGET_DIR=$target \
                program --target aarch64-unknown-linux-gnu)
            digests aarch64 qemu-aarch64 -L /usr/aarch64-linux-gnu "$built"
            ;;
        *)
            echo "other-processors.sh: found $of, needed nehalem, haswell or aarch64" >&2
            exit 2
            ;;
    esac
done
for of in "${missing[@]}"; do echo "left out: $of"; done
if [ ${#failed[@]} -gt 0 ]; then
    echo "other digests than those kept: ${failed[*]}" >&2
    exit 1
fi
[ ${#missing[@]} -eq 0 ] || exit 77
