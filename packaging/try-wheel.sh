#!/bin/sh
# A wheel in an image of its own: installed from a folder, and a run with it.
#   sh packaging/try-wheel.sh FOLDER
set -eu
if command -v dnf >/dev/null; then dnf install -y -q python3.11 python3.11-pip >/dev/null; python=python3.11; else python=python3; fi
"$python" -m venv /tmp/venv
/tmp/venv/bin/pip install --quiet numpy
/tmp/venv/bin/pip install --quiet --no-index --find-links "$1" --no-deps standstill
cd /tmp
/tmp/venv/bin/python -c 'import standstill as st; r = st.run("trials = 50\n[detector]\nmethod = \"bipolar\""); print(r); assert r.summary["wrong_poles"] == 0, r.summary'
for text in LICENSE-APACHE LICENSE-MIT LICENSES.txt THIRD-PARTY.md; do
    find /tmp/venv/lib* -path "*standstill-*.dist-info/licenses/$text" | grep -q . || { echo "the wheel has no $text" >&2; exit 1; }
done
