#!/usr/bin/env python3
"""The counts of docs/faults.md and docs/notes/faults-methods.md, measured anew.

    python3 scripts/faults-tables.py PROGRAM          all of it: some ten minutes of two cores
    python3 scripts/faults-tables.py PROGRAM methods  docs/notes/faults-methods.md alone; or: found

Writes docs/notes/faults-MOTOR.csv and the rows of the tables in both pages, by the names of their faults. Text beside the tables stays: read it.
"""
import csv, io, os, re, subprocess, sys, tempfile

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..")
MOTORS = ["paper-5k5", "light-vehicle"]
METHODS = [["line-inductance", "line-inductance-fast", "subdivision", "hfi-rotating", "hfi-pulsating", "bipolar", "maximum-likelihood",
            "maximum-likelihood-adaptive"], ["open-terminal", "six-pulse"]]
OTHERS = ["-s", "sensors.terminals=true", "-s", "sensors.timer=0.32 us"]
# What the tables call the most frequent reason.
SHORT = {"pole not certain enough": "pole open", "a phase has more resistance than the others": "contact", "current sensors disagree": "sensors",
         "inductance not as on the data sheet": "inductance", "DC link not as on the data sheet": "link"}


def study(program, motor, methods, trials, keys=()):
    """The rows of `standstill faults`, and the file's text."""
    with tempfile.TemporaryDirectory() as folder:
        with open(f"{folder}/s.toml", "w") as scenario:
            scenario.write(f'motor = "{motor}"\nerrors = "default"\n')
        named = [word for method in methods for word in ("--method", method)]
        subprocess.run([program, "faults", "s.toml", *named, *keys, "--trials", str(trials), "--out", "f"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
        text = open(f"{folder}/f/faults.csv", newline="").read()
    return list(csv.DictReader(io.StringIO(text))), text


def share(count, trials, digits):
    """Per cent as the tables have it: whole ones, or two digits below ten."""
    of = 100.0 * float(count) / float(trials)
    if digits and 0.0 < of < 10.0 or digits and 99.5 <= of < 100.0:
        return f"{of:.1f}"
    return f"{of:.0f}"


def cell(row, digits):
    parts = [share(row[key], row["trials"], digits) for key in ("wrong_pole", "right_pole_beyond_limit", "detected")]
    return " · ".join(parts)


def name(row):
    later = {"during": ", during", "50 us": ", 50 µs"}.get(row["begins"], "")
    return "no fault" if row["failure_mode"] == "as it is" else f"`{row['failure_mode']}`{later}"


def replaced(text, head, cells):
    """The table below a line that begins with `head`, its rows with new cells by the name of the fault."""
    start = text.index(head)
    end = text.find("\n\n", text.index("\n|---", start))
    lines = text[start:end].split("\n")
    for k, line in enumerate(lines):
        fault = line.split("|")[1].strip() if line.startswith("| ") else ""
        if fault in cells:
            lines[k] = f"| {fault} | " + " | ".join(cells[fault]) + " |"
    return text[:start] + "\n".join(lines) + text[end:]


def found(program):
    cells = {}
    for motor in MOTORS:
        rows, text = study(program, motor, ["bipolar", "maximum-likelihood"], 3000)
        open(f"{ROOT}/docs/notes/faults-{motor}.csv", "w", newline="").write(text)
        for row in rows:
            reason = SHORT.get(row["detected_by"], row["detected_by"])
            if float(row["undetermined"]) > 0.5 * float(row["detected"]):
                reason = "pole open"
            said = cell(row, True) + (f" {reason}" if float(row["detected"]) else "")
            cells.setdefault(name(row), []).append(said)
        print(f"{motor}: {sum(float(row['wrong_pole']) == 0 for row in rows)} of {len(rows)} rows without a wrong pole", flush=True)
    page = f"{ROOT}/docs/faults.md"
    text = open(page).read()
    open(page, "w").write(replaced(text, "| fault | `paper-5k5`, `bipolar`", cells))


def methods(program):
    page = f"{ROOT}/docs/notes/faults-methods.md"
    text = open(page).read()
    for motor in MOTORS:
        tables = [study(program, motor, of, 300, ["--begins", "before", *keys])[0] for of, keys in zip(METHODS, ([], OTHERS))]
        counts = {(row["method"], name(row)): cell(row, False) for rows in tables for row in rows}
        faults = {fault for _, fault in counts}
        cells = {fault: [counts.get((method, fault), "–") for group in METHODS for method in group] for fault in faults}
        head = text.index(f"## `{motor}`")
        text = text[:head] + replaced(text[head:], "| fault | line |", cells)
        print(f"{motor}: {len(faults)} faults", flush=True)
    open(page, "w").write(text)


def main():
    program, parts = os.path.abspath(sys.argv[1]), sys.argv[2:] or ["found", "methods"]
    for part in parts:
        {"found": found, "methods": methods}[part](program)


main()
