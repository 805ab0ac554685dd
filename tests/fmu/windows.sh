#!/usr/bin/env bash
# One FMU for Linux and Windows: the same steps by its library for this machine, and by that for Windows under wine, must give the
# same bits of every output.
#
#     tests/fmu/windows.sh FOLDER      the folder of the program, with fmu-binaries from scripts/fmu-binaries.sh
#
# Ends with 77 where mingw, wine or python3 is missing.
set -euo pipefail
programs=$(cd "${1:?usage: tests/fmu/windows.sh FOLDER}" && pwd)
here=$(cd "$(dirname "$0")" && pwd)
wine=$(command -v wine64 || command -v wine || ls /usr/lib/wine/wine64 2>/dev/null || true)
for tool in x86_64-w64-mingw32-gcc cc python3; do
    command -v $tool >/dev/null || { echo "$tool is not here: the FMU for Windows was not run"; exit 77; }
done
[ -n "$wine" ] || { echo "wine is not here: the FMU for Windows was not run"; exit 77; }
[ -f "$programs/fmu-binaries/x86_64-windows.dll" ] || { echo "no $programs/fmu-binaries/x86_64-windows.dll: scripts/fmu-binaries.sh first" >&2; exit 2; }
work=$(mktemp -d)
export WINEPREFIX=$work/wine WINEDEBUG=-all DISPLAY=
# Wine writes its registry as it ends.
trap 'command -v wineserver >/dev/null && wineserver -w; rm -rf "$work"' EXIT
cd "$work"
printf 'motor = "low-inertia"\ninverter.carrier = 12500\nerrors = "field"\nseed = 7\nrotor.state = "free"\nrotor.angle = 40\n' >drive.toml
"$programs/standstill" fmu drive.toml -o drive.fmu
python3 - <<'PY'
import xml.etree.ElementTree as tree, zipfile
archive = zipfile.ZipFile("drive.fmu")
archive.extractall("drive")
needed = {"binaries/linux64/standstill_drive.so", "binaries/win64/standstill_drive.dll", "model.png", "documentation/index.html"}
assert needed <= set(archive.namelist()), archive.namelist()
root = tree.parse("drive/modelDescription.xml").getroot()
lines = []
for variable in root.iter("ScalarVariable"):
    role = {"input": "in", "output": "out"}.get(variable.get("causality"))
    kind = variable[0].tag
    if role and kind != "Boolean":
        lines.append(f"{role} {variable.get('valueReference')} {'Real' if kind == 'Real' else 'Integer'}")
open("variables", "w").write("\n".join(lines) + "\n")
open("token", "w").write(root.get("guid"))
PY
cc -O1 -o importer "$here/importer.c" -ldl
x86_64-w64-mingw32-gcc -O1 -o importer.exe "$here/importer.c"
# Before wine 8.13 there is none; where wine has its own, that is taken.
x86_64-w64-mingw32-gcc -O1 -shared -o bcryptprimitives.dll "$here/bcryptprimitives.c" -ladvapi32
./importer "$PWD/drive/binaries/linux64/standstill_drive.so" "file://$PWD/drive/resources" "$(cat token)" <variables >linux
"$wine" importer.exe 'drive\binaries\win64\standstill_drive.dll' "file:///Z:$PWD/drive/resources" "$(cat token)" <variables | tr -d '\r' >windows
[ "$(wc -l <linux)" = 60 ] || { echo "$(wc -l <linux) steps on Linux, 60 were asked" >&2; exit 1; }
cmp linux windows
echo "60 steps, $(($(head -1 linux | wc -w) - 1)) outputs: the same bits on Linux and, under wine, on Windows"
