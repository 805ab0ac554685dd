#!/usr/bin/env bash
# Lines of production code: `crates/*/src/**/*.rs` without files of tests, `mod tests` and what else stands under `#[cfg(test)]`, blank
# lines and comments. One line a crate and the sum.
#   scripts/count-lines.sh            all crates
#   scripts/count-lines.sh files sim  the lines of each file of one crate
set -euo pipefail
cd "$(dirname "$0")/.."

# Reads one file; an item under `#[cfg(test)]` ends with the closing brace of its own indentation, or with its first line's semicolon.
count() {
    awk '
        /^[[:space:]]*$/ || /^[[:space:]]*\/\// { next }
        inside { if ($0 ~ end) inside = 0; next }
        gated && /^[[:space:]]*#\[/ { next }
        gated {
            gated = 0
            if ($0 ~ /;[[:space:]]*$/) next
            match($0, /^[[:space:]]*/)
            end = "^" substr($0, 1, RLENGTH) "}"
            inside = 1
            next
        }
        /^[[:space:]]*#\[cfg\(test\)\]/ { gated = 1; next }
        { lines++ }
        END { print lines + 0 }
    ' "$1"
}

files() { git ls-files "crates/$1/src/*.rs" | grep -vE '(^|/)(tests|testing)(\.rs$|/)' || true; }

if [ "${1:-}" = files ]; then
    files "$2" | while read -r file; do printf '%6d  %s\n' "$(count "$file")" "$file"; done | sort -rn
    exit
fi

total=0
for folder in crates/*/; do
    crate=$(basename "$folder")
    sum=0
    while read -r file; do sum=$((sum + $(count "$file"))); done < <(files "$crate")
    printf '%6d  %s\n' "$sum" "$crate"
    total=$((total + sum))
done
printf '%6d  in all\n' "$total"
