#!/usr/bin/env bash
# The library of FMUs for other kinds of machines, into the folder fmu-binaries beside the program, from where `standstill fmu` packs
# them beside this machine's: one FMU then runs on all of them.
#
#     scripts/fmu-binaries.sh            x86_64-windows
#     scripts/fmu-binaries.sh --try      and runs it, where wine is there: the same bits as on this machine
#
# Needs mingw (Debian: gcc-mingw-w64-x86-64) and the target (`rustup target add x86_64-pc-windows-gnu`).
set -euo pipefail
cd "$(dirname "$0")/.."
attempt=${1:-}
[ -z "$attempt" ] || [ "$attempt" = --try ] || { echo "fmu-binaries.sh: found $attempt, needed --try or nothing" >&2; exit 2; }
target=${CARGO_TARGET_DIR:-target}
triple=x86_64-pc-windows-gnu
command -v x86_64-w64-mingw32-gcc >/dev/null || { echo "mingw is missing: apt-get install gcc-mingw-w64-x86-64" >&2; exit 77; }
if [ ! -d "$(rustc --print target-libdir --target $triple)" ]; then
    echo "the target is missing: rustup target add $triple" >&2
    exit 77
fi
cargo build --release --locked -p standstill-fmu --target $triple
mkdir -p "$target/release/fmu-binaries"
cp "$target/$triple/release/standstill_fmu.dll" "$target/release/fmu-binaries/x86_64-windows.dll"
echo "x86_64-windows: $(stat -c %s "$target/release/fmu-binaries/x86_64-windows.dll") bytes in $target/release/fmu-binaries"
# What it takes from Windows: libraries of the system alone, none of mingw.
needs=$(x86_64-w64-mingw32-objdump -p "$target/release/fmu-binaries/x86_64-windows.dll" | sed -n 's/.*DLL Name: //p')
for name in $needs; do
    case ${name,,} in
        kernel32.dll | ntdll.dll | ws2_32.dll | userenv.dll | advapi32.dll | bcrypt.dll | bcryptprimitives.dll | msvcrt.dll | \
            api-ms-win-*.dll | shell32.dll | ole32.dll) ;;
        *) echo "fmu-binaries.sh: the library needs $name, which is no part of Windows" >&2; exit 1 ;;
    esac
done
if [ -n "$attempt" ]; then
    exec bash tests/fmu/windows.sh "$target/release"
fi
