#!/usr/bin/env bash
# Writes THIRD-PARTY.md: the crates that the program, the library of FMUs and Python's package contain, with their versions
# and licences, and LICENSES.txt, which is
# crates/fmu/src/third-party.txt: the licences' texts with their copyright lines, which archives, wheels and FMUs bring along. With `--check`
# it only compares. Ends with code 1 where a file is out of date or a licence is not one of those that were agreed to.
set -euo pipefail
cd "$(dirname "$0")/.."

# Licences and the machines that are released for: deny.toml has them.
agreed=$(sed -n '/^allow = \[$/,/^\]$/ s/^ *"\(.*\)",$/\1/p' deny.toml | paste -sd '|')
targets=$(sed -n '/^targets = \[$/,/^\]$/ s/^ *"\(.*\)",$/--target \1/p' deny.toml)

# Name, version and licence, without our own crates. Cobyla has its licence as a text, which is MIT's.
crates() {
    # shellcheck disable=SC2086 # options
    {
        cargo tree --locked -p standstill --edges normal $targets --format '{p}|{l}' --prefix none
        cargo tree --locked --manifest-path crates/python/Cargo.toml --edges normal $targets --format '{p}|{l}' --prefix none
    } |
        sed -E 's/ \(\*\)$//; s/ \(proc-macro\)//; s/ v([0-9][^|]*)/|\1/; s/^(cobyla\|.*\|)$/\1MIT/' | grep -vE '^(standstill|$)' | sort -u
}

page() {
    cat <<'HEAD'
# Third-party notices

The program, the library in FMUs and Python's package contain these crates, some of them only one of the three, each under the licence
beside it; the licences' texts are in [LICENSES.txt](LICENSES.txt). `scripts/third-party.sh` writes both. The font and the chart library in figures and pages, with their licences, are named
in [`crates/report/assets`](crates/report/assets/README.md).

| crate | version | licence |
|---|---|---|
HEAD
    crates | sed -E 's/^([^|]*)\|([^|]*)\|(.*)$/| \1 | \2 | \3 |/'
}

# The text of each crate's licence, MIT's where there is a choice; equal texts once, below the names of those that have it.
texts() {
    {
        cargo metadata --locked --format-version 1
        echo
        cargo metadata --locked --format-version 1 --manifest-path crates/python/Cargo.toml
    } | python3 -c '
import collections, json, pathlib, re, sys

wanted = {tuple(line.split("|")[:2]) for line in open(sys.argv[1])}
texts, silent = collections.defaultdict(set), []
for line in filter(str.strip, sys.stdin):
    for package in json.loads(line)["packages"]:
        crate = package["name"], package["version"]
        if crate not in wanted:
            continue
        wanted.remove(crate)
        folder = pathlib.Path(package["manifest_path"]).parent
        files = sorted(p for p in folder.iterdir() if p.is_file() and re.match("(licen[cs]e|copying|unlicense|notice)", p.name, re.I))
        mit = [p for p in files if "mit" in p.name.lower()]
        chosen = mit if mit and "MIT" in re.split(r" OR |/", package["license"] or "") else files
        for text in (p.read_text("utf-8").strip().replace("\r\n", "\n") for p in chosen):
            texts["\n".join(line.rstrip() for line in text.expandtabs().split("\n"))].add(" ".join(crate))
        if not files:
            silent.append(" ".join(crate) + ": " + package["license"] + ", " + ", ".join(package["authors"] or ["its authors"]))
assert not wanted, f"no source of {wanted}"
print("Licences of what Standstill contains of others: THIRD-PARTY.md lists the crates.")
print("\nWithout a text in their package, under the licence named here:\n")
print("\n".join(["the standard library of Rust: MIT OR Apache-2.0, The Rust Project Developers", *sorted(silent)]))
for asset, name in ("DejaVuSans", "DejaVu Sans, the letters of figures"), ("plotly", "plotly.js, the charts of pages"):
    texts[pathlib.Path(f"crates/report/assets/{asset}-LICENSE.txt").read_text("utf-8").strip()].add(name)
for text, crates in sorted(texts.items(), key=lambda item: sorted(item[1])):
    print("\n" + "=" * 80 + "\n" + "\n".join(sorted(crates)) + "\n" + "-" * 80 + "\n\n" + text)
' <(crates)
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
    diff <(texts) crates/fmu/src/third-party.txt >&2 || { echo "LICENSES.txt is out of date: run scripts/third-party.sh" >&2; exit 1; }
else
    page >THIRD-PARTY.md
    texts >crates/fmu/src/third-party.txt
fi
