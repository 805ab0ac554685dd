#!/usr/bin/env bash
# Runs the commands with which a page begins, as printed: its first block of shell commands, in a scratch folder with
# the repository's folders in it.
#   scripts/run-page.sh docs/fmi.md
# The programs of the page (standstill, python, pip, fmpy) must be on the PATH.
set -euo pipefail
root=$(realpath "$(dirname "$0")/..")
page=$(realpath "$1")
block=$(awk '/^```sh$/ && !done {on = 1; next} /^```$/ && on {on = 0; done = 1} on' "$page")
[ -n "$block" ] || { echo "$1 does not begin with a block of commands (\`\`\`sh)" >&2; exit 1; }
[ "${2:-}" != --print ] || { printf '%s\n' "$block"; exit 0; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
for name in Cargo.toml Cargo.lock crates docs examples; do ln -s "$root/$name" .; done
while IFS= read -r line; do
    [ -n "$line" ] || continue
    printf '\n$ %s\n' "$line"
    bash -euo pipefail -c "$line"
done <<<"$block"
