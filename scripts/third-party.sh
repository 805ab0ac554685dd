#!/usr/bin/env bash
# Writes THIRD-PARTY.md: the crates that the program, the library of FMUs and Python's package contain, with their versions
# and licences; with `--check` it only
# compares. Ends with code 1 where the file is out of date or a licence is not one of those that were agreed to.
set -euo pipefail
cd "$(dirname "$0")/.."

agreed='MIT|Apache-2.0|Apache-2.0 WITH LLVM-exception|BSD-2-Clause|BSD-3-Clause|ISC|Zlib|Unlicense|0BSD|BSL-1.0|CC0-1.0|Unicode-3.0'

# Name, version and licence, without our own crates. Cobyla has its licence as a text, which is MIT's.
crates() {
    {
        cargo tree --locked -p standstill --edges normal --target all --format '{p}|{l}' --prefix none
        cargo tree --locked --manifest-path crates/python/Cargo.toml --edges normal --target all --format '{p}|{l}' --prefix none
    } |
        sed -E 's/ \(\*\)$//; s/ \(proc-macro\)//; s/ v([0-9][^|]*)/|\1/; s/^(cobyla\|.*\|)$/\1MIT/' | grep -v '^standstill' | sort -u
}

page() {
    cat <<'HEAD'
# Third-party notices

The program, the library in FMUs and Python's package contain these crates, some of them only one of the three, each under the licence
beside it; a copy of each licence stands in the crate's source on crates.io. `scripts/third-party.sh` writes this list. The font and the chart library in figures and pages, with their licences, are named
in [`crates/report/assets`](crates/report/assets/README.md).

| crate | version | licence |
|---|---|---|
HEAD
    crates | sed -E 's/^([^|]*)\|([^|]*)\|(.*)$/| \1 | \2 | \3 |/'
}

# Of alternatives one must be agreed to, of licences that hold together all.
refused=$(crates | while IFS='|' read -r name version licence; do
    good=no
    while read -r choice; do
        all=yes
        while read -r part; do
            grep -qxE "($agreed)" <<<"$part" || all=no
        done < <(sed 's/ AND /\n/g' <<<"$choice")
        [ "$all" = yes ] && good=yes
    done < <(sed -E 's/[()]//g; s#/| OR #\n#g' <<<"$licence")
    [ "$good" = yes ] || echo "$name $version: licence \"$licence\""
done)
if [ -n "$refused" ]; then
    printf 'licences that nobody agreed to:\n%s\n' "$refused" >&2
    exit 1
fi

if [ "${1:-}" = --check ]; then
    diff <(page) THIRD-PARTY.md >&2 || { echo "THIRD-PARTY.md is out of date: run scripts/third-party.sh" >&2; exit 1; }
else
    page >THIRD-PARTY.md
fi
