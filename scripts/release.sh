#!/usr/bin/env bash
# A release is one command: archives with the program, wheels, checksums, recipes of package managers; up to the upload, which it prints.
#
#     scripts/release.sh FOLDER                  what this machine can build (--only TARGET: one of the targets; --only wheels)
#     scripts/release.sh FOLDER --finish         recipes and checksums of the archives that are in FOLDER, as the workflow gathers them
#     scripts/release.sh FOLDER --check          whether versions, names and checksums in FOLDER agree
#     scripts/release.sh --names                 the archives of a release
#
# With STANDSTILL_HOME, the address of the repository, recipes have whole addresses; without it they name it @HOME@, and cannot be used.
# Linux needs zig (`pip install ziglang cargo-zigbuild maturin`), Windows mingw (Debian: gcc-mingw-w64-x86-64); each target needs
# `rustup target add TARGET`. What is missing is said and left out.
set -euo pipefail
cd "$(dirname "$0")/.."
version=$(sed -n '/^\[workspace.package\]/,/^version/s/^version = "\(.*\)"$/\1/p' Cargo.toml)
home=${STANDSTILL_HOME:-@HOME@}
home=${home%/}
# The oldest C library of Linux that the program and its wheel ask for.
glibc=2.28
# A target, and how its archive ends. Those of musl are static and run on any Linux; a detector in C needs the loader of glibc.
targets='x86_64-unknown-linux-gnu tar.gz
aarch64-unknown-linux-gnu tar.gz
x86_64-unknown-linux-musl tar.gz
aarch64-unknown-linux-musl tar.gz
x86_64-apple-darwin tar.gz
aarch64-apple-darwin tar.gz
x86_64-pc-windows-gnu zip'
fail() { echo "release.sh: $*" >&2; exit 1; }
usage() { sed -n 's/^# \{0,1\}//; 4,7p' scripts/release.sh >&2; exit 2; }

archive() { echo "standstill-$version-$1.$(awk -v of="$1" '$1 == of { print $2 }' <<<"$targets")"; }
names() { while read -r triple _; do archive "$triple"; done <<<"$targets"; }

[ $# -ge 1 ] || usage
if [ "$1" = --names ]; then names; exit; fi
case $1 in -*) usage ;; esac
mkdir -p "$1"
out=$(cd "$1" && pwd)
how=${2:-build}
only=${3:-}
case $how:$# in build:1 | --finish:2 | --check:2) ;; --only:3) how=build ;; *) usage ;; esac
target=$(realpath -m "${CARGO_TARGET_DIR:-target}")
left_out=()
missing() { left_out+=("$1"); echo "left out: $1"; }
wants() { [ -z "$only" ] || [ "$only" = "$1" ]; }

# One number, in all places that have it.
agree() {
    local place found
    while IFS='|' read -r place found; do
        [ "$found" = "$version" ] || fail "$place: found version \"$found\", needed $version, as in Cargo.toml"
    done <<PLACES
CITATION.cff|$(sed -n 's/^version: //p' CITATION.cff)
crates/python/Cargo.toml|$(sed -n '/^\[package\]/,/^\[/s/^version = "\(.*\)"$/\1/p' crates/python/Cargo.toml)
crates/lab/wasm/Cargo.toml|$(sed -n '/^\[package\]/,/^\[/s/^version = "\(.*\)"$/\1/p' crates/lab/wasm/Cargo.toml)
PLACES
    grep -qE "^## (Unreleased \($version\)|$version( |\$))" CHANGELOG.md || fail "CHANGELOG.md: no heading of $version"
}

# Whether a target can be built here; says what is missing.
can() {
    local triple=$1
    if [ ! -d "$(rustc --print target-libdir --target "$triple")" ]; then missing "$triple: rustup target add $triple"; return 1; fi
    case $triple in
        *-linux-*) command -v cargo-zigbuild >/dev/null || { missing "$triple: pip install ziglang cargo-zigbuild"; return 1; } ;;
        *-windows-gnu) command -v x86_64-w64-mingw32-gcc >/dev/null || { missing "$triple: apt-get install gcc-mingw-w64-x86-64"; return 1; } ;;
        *-apple-*) [ "$(uname)" = Darwin ] || { missing "$triple: macOS (the workflow builds it)"; return 1; } ;;
    esac
}

# Builds packages for a target, with a C library that is old enough.
compile() {
    local triple=$1
    shift
    case $triple in
        *-linux-gnu) cargo zigbuild --release --locked --target "$triple.$glibc" "$@" ;;
        *-linux-musl) cargo zigbuild --release --locked --target "$triple" "$@" ;;
        *) cargo build --release --locked --target "$triple" "$@" ;;
    esac
}

# The library of FMUs: its file as Cargo names it, and its name among those of other machines. Importers on Linux have glibc.
library() {
    case $1 in
        x86_64-unknown-linux-*) echo libstandstill_fmu.so x86_64-linux.so ;;
        aarch64-unknown-linux-*) echo libstandstill_fmu.so aarch64-linux.so ;;
        x86_64-apple-darwin) echo libstandstill_fmu.dylib x86_64-darwin.dylib ;;
        aarch64-apple-darwin) echo libstandstill_fmu.dylib aarch64-darwin.dylib ;;
        x86_64-pc-windows-gnu) echo standstill_fmu.dll x86_64-windows.dll ;;
    esac
}

# An archive of a target: the program, the libraries of FMUs, completions, manual pages, licences.
pack() {
    local triple=$1 name folder file
    name=standstill-$version-$triple
    folder=$out/work/$name
    rm -rf "$folder"
    mkdir -p "$folder/fmu-binaries"
    cp "$target/$triple/release/standstill"{,.exe} "$folder/" 2>/dev/null || true
    read -r file own <<<"$(library "$triple")"
    if [ -f "$out/fmu-binaries/$own" ]; then cp "$out/fmu-binaries/$own" "$folder/$file"; fi
    for file in "$out"/fmu-binaries/*; do
        [ ! -f "$file" ] || [ "$(basename "$file")" = "$own" ] || cp "$file" "$folder/fmu-binaries/"
    done
    cp README.md CHANGELOG.md LICENSE-APACHE LICENSE-MIT LICENSES.txt THIRD-PARTY.md "$folder/"
    cp -r "$out/work/shared/." "$folder/"
    # The same content gives the same archive.
    (
        cd "$out/work"
        find "$name" -exec touch -h -d '2026-01-01T00:00:00Z' {} +
        rm -f "$out/$(archive "$triple")"
        case $(archive "$triple") in
            *.zip) find "$name" -type f | LC_ALL=C sort | python3 -c '
import sys, zipfile
with zipfile.ZipFile(sys.argv[1], "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
    for name in sys.stdin.read().splitlines():
        archive.write(name)' "$out/$(archive "$triple")" ;;
            *) tar --sort=name --owner=0 --group=0 --numeric-owner -cf - "$name" | gzip -9n >"$out/$(archive "$triple")" ;;
        esac
    )
    echo "$(archive "$triple"): $(stat -c %s "$out/$(archive "$triple")") bytes"
}

# Completions and manual pages, by a program that runs here.
shared() {
    local program=$1 shell
    rm -rf "$out/work/shared"
    mkdir -p "$out/work/shared/completions" "$out/work/shared/man"
    for shell in bash zsh fish powershell elvish; do "$program" completions $shell >"$out/work/shared/completions/standstill.$shell"; done
    "$program" man --out "$out/work/shared/man" >/dev/null
    "$program" schema >"$out/work/shared/scenario.schema.json"
}

wheels() {
    local platform
    command -v maturin >/dev/null || { missing "wheels: pip install maturin ziglang"; return; }
    while read -r triple platform; do
        [ -d "$(rustc --print target-libdir --target "$triple")" ] || { missing "wheel $triple: rustup target add $triple"; continue; }
        CARGO_TARGET_DIR=$target/python maturin build --release --locked --zig --compatibility "$platform" --target "$triple" \
            --interpreter python3.11 --manifest-path crates/python/Cargo.toml --out "$out" --quiet
    done <<PLATFORMS
x86_64-unknown-linux-gnu manylinux_2_28
aarch64-unknown-linux-gnu manylinux_2_28
PLATFORMS
    for wheel in "$out"/standstill-"$version"-*.whl; do
        echo "$(basename "$wheel"): $(stat -c %s "$wheel") bytes"
        [ "$(stat -c %s "$wheel")" -le 5200000 ] || fail "$(basename "$wheel"): more than 5.2 MB"
    done
}

# Recipes with this version, these names and these checksums.
finish() {
    local recipe triple sum
    (cd "$out" && sha256sum -- standstill-"$version"-*.{tar.gz,zip,whl} 2>/dev/null >SHA256SUMS) || true
    [ -s "$out/SHA256SUMS" ] || fail "$out: no archive of $version"
    rm -rf "$out/recipes"
    cp -r packaging/recipes "$out/recipes"
    find "$out/recipes" -type f | while read -r recipe; do
        sed -i -e "s#@VERSION@#$version#g" -e "s#@HOME@#$home#g" "$recipe"
        while read -r triple _; do
            sum=$(awk -v of="$(archive "$triple")" '$2 == of { print $1 }' "$out/SHA256SUMS")
            sed -i -e "s#@ARCHIVE:$triple@#$(archive "$triple")#g" "$recipe"
            [ -z "$sum" ] || sed -i -e "s#@SHA256:$triple@#$sum#g" "$recipe"
        done <<<"$targets"
    done
    echo "recipes: $(cd "$out/recipes" && find . -type f | sort | tr '\n' ' ')"
}

# Versions, names and checksums, read again from what is there.
check() {
    local recipe name sum
    (cd "$out" && sha256sum --quiet -c SHA256SUMS) || fail "a checksum of SHA256SUMS is not its file's"
    [ "$(sed -n 's/^version=//p; s/^ARG VERSION=//p' "$out/recipes/Containerfile")" = "$version" ] || fail "recipes/Containerfile: not $version"
    grep -rhoE '^PackageVersion: .*' "$out/recipes/winget" | sort -u | grep -x "PackageVersion: $version" >/dev/null || fail "recipes/winget: not $version"
    grep -rhoE "standstill-$version-[a-z0-9_]+-[a-z0-9-]+\.(tar\.gz|zip)" "$out/recipes" | sort -u | while read -r name; do
        names | grep -xF "$name" >/dev/null || fail "$name: no archive of a release"
    done
    python3 - "$out" "$version" <<'PY' || fail "a checksum of a recipe"
# Each checksum in a recipe is that of the archive that the recipe names last before it, or first after it where it names none before.
import pathlib, re, sys
out, version = pathlib.Path(sys.argv[1]), sys.argv[2]
sums = dict(reversed(line.split()) for line in (out / "SHA256SUMS").read_text().splitlines())
wrong = 0
for recipe in sorted(path for path in (out / "recipes").rglob("*") if path.is_file()):
    name, text = None, recipe.read_text()
    for found in re.finditer(rf"standstill-{re.escape(version)}-[a-z0-9_-]+\.(?:tar\.gz|zip)|\b[0-9a-fA-F]{{64}}\b", text):
        if found[0].startswith("standstill-"):
            name = found[0]
        elif sums.get(name) != found[0].lower():
            print(f"{recipe}: found {found[0]} for {name}, needed {sums.get(name)} of SHA256SUMS", file=sys.stderr)
            wrong += 1
    lacks = sorted(set(re.findall(r"@SHA256:([^@]*)@", text)))
    if lacks:
        print(f"not complete: {recipe.relative_to(out)} has no checksum of {', '.join(lacks)}")
sys.exit(wrong != 0)
PY
    while read -r name; do [ -f "$out/$name" ] || echo "not complete: $name is not there"; done < <(names)
    echo "versions, names and checksums in $out agree: $(wc -l <"$out/SHA256SUMS") files of $version"
}

agree
case $how in
    --finish) finish; check ;;
    --check) check ;;
    build)
        # What .ci/run leaves to it.
        if [ -z "$only" ] && [ "$(uname)" = Linux ]; then scripts/ci-more.sh; fi
        mkdir -p "$out/fmu-binaries" "$out/work"
        # Libraries of FMUs first: each archive has them all.
        while read -r triple _; do
            if ! can "$triple"; then continue; fi
            case $triple in *-musl) continue ;; esac
            wants "$triple" || wants fmu || continue
            read -r file own <<<"$(library "$triple")"
            compile "$triple" -p standstill-fmu
            cp "$target/$triple/release/$file" "$out/fmu-binaries/$own"
        done <<<"$targets"
        if [ "$only" = fmu ]; then exit; fi
        here=$(rustc -vV | sed -n 's/^host: //p')
        built=
        while read -r triple _; do
            wants "$triple" && can "$triple" >/dev/null || continue
            compile "$triple" -p standstill
            case $triple in "$here") built=$target/$triple/release/standstill ;; esac
        done <<<"$targets"
        if [ -z "$built" ] && [ "$only" != wheels ]; then
            cargo build --release --locked -p standstill
            built=$target/release/standstill
        fi
        [ -z "$built" ] || shared "$built"
        while read -r triple _; do
            wants "$triple" && can "$triple" >/dev/null || continue
            pack "$triple"
        done <<<"$targets"
        if wants wheels; then wheels; fi
        rm -rf "$out/work"
        for part in "${left_out[@]}"; do echo "left out: $part"; done | sort -u
        finish
        check
        ;;
esac
cat <<UPLOAD
next, once it is looked at:
    git tag -s v$version && git push origin v$version
    gh release create v$version --title "Standstill $version" --notes-file CHANGELOG.md $out/standstill-$version-* $out/SHA256SUMS
    cargo publish --workspace --exclude standstill-workspace --locked
    twine upload $out/standstill-$version-*.whl
UPLOAD
