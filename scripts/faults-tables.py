#!/usr/bin/env python3
"""The counts of docs/faults.md and docs/notes/faults-methods.md, measured anew.

    python3 scripts/faults-tables.py PROGRAM          all of it: an hour of one core
    python3 scripts/faults-tables.py PROGRAM methods  docs/notes/faults-methods.md alone; or: found (docs/notes/faults-MOTOR.csv and docs/faults.md), page (docs/faults.md of these files)

Writes docs/notes/faults-MOTOR.csv and the tables in both pages. Text beside the tables stays: read it.
"""
import csv, io, os, subprocess, sys, tempfile

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..")
# Each with the capacitor of a DC link and its source's resistance.
MOTORS = {"paper-5k5": ("200 uF", "0.2 ohm"), "light-vehicle": ("20 mF", "3 mohm"), "cross-saturation": ("200 uF", "0.2 ohm")}
THREADS = os.environ.get("THREADS", "1")
# Modes that need more than the default drive has.
MORE = ["link-capacitor-aged", "supply-weak", "supply-limited", "current-slow", "comparator-stuck", "timer-off"]
METHODS = [["line-inductance", "line-inductance-fast", "subdivision", "hfi-rotating", "hfi-pulsating", "bipolar", "maximum-likelihood",
            "maximum-likelihood-adaptive"], ["open-terminal", "six-pulse"], ["dc-alignment"]]
# Alignment turns the rotor, and simulates seconds: a third of the starts of the others.
ALIGNED, FREE = 100, ["-s", "rotor.state=free"]
# Methods whose samples lie at the end of their commands, beyond which `sample-late` moves none; and those that read no current here.
AT_END = ["subdivision", "hfi-rotating", "hfi-pulsating", "dc-alignment"]
WITHOUT_CURRENT = METHODS[1]
OTHERS = ["-s", "sensors.terminals=true", "-s", "sensors.timer=0.32 us"]
# What the tables call the most frequent reason.
SHORT = {"pole not certain enough": "pole open", "a phase has more resistance than the others": "contact", "current sensors disagree": "sensors",
         "inductance not as on the data sheet": "inductance", "DC link not as on the data sheet": "link"}


def study(program, motor, methods, trials, keys=(), drive=""):
    """The rows of `standstill faults`, and the file's text."""
    with tempfile.TemporaryDirectory() as folder:
        with open(f"{folder}/s.toml", "w") as scenario:
            scenario.write(f'motor = "{motor}"\nerrors = "default"\n{drive}')
        named = [word for method in methods for word in ("--method", method)]
        subprocess.run([program, "faults", "s.toml", *named, *keys, "--trials", str(trials), "--threads", THREADS, "--out", "f"],
                       cwd=folder, check=True, stdout=subprocess.DEVNULL)
        text = open(f"{folder}/f/faults.csv", newline="").read()
    return list(csv.DictReader(io.StringIO(text))), text


def studies(program, motor, methods, trials, keys=()):
    """The rows of all modes: those of the default drive, and those of a drive with capacitor, filters and timer, whose row without a fault is named so."""
    rows, text = study(program, motor, methods, trials, keys)
    capacitance, resistance = MOTORS[motor]
    drive = f'[inverter]\ncapacitance = "{capacitance}"\nsource_resistance = "{resistance}"\n[sensors]\nbandwidth = "200 kHz"\ntimer = "0.32 us"\n'
    modes = [word for mode in MORE for word in ("--mode", mode)]
    others, more = study(program, motor, methods, trials, [*keys, *modes], drive)
    more = more.replace(",as it is,", ",as it is with more parts,")
    return rows + list(csv.DictReader(io.StringIO(more))), text + more.split("\n", 1)[1]


def share(count, trials, digits):
    """Per cent as the tables have it: whole ones, or two digits below ten."""
    of = 100.0 * float(count) / float(trials)
    if digits and 0.0 < of < 10.0 or digits and 99.5 <= of < 100.0:
        text = f"{of:.1f}"
        return f"{of:.2f}" if text in ("0.0", "100.0") else text
    return f"{of:.0f}"


def cell(row, digits):
    parts = [share(row[key], row["trials"], digits) for key in ("wrong_pole", "right_pole_beyond_limit", "detected")]
    return " · ".join(parts)


def name(row):
    named = {"as it is": "no fault", "as it is with more parts": "no fault, with capacitor, filters, timer"}
    return named.get(row["failure_mode"], f"`{row['failure_mode']}`")


def written(page, head, heads, cells):
    """Replaces the first table below `head` in a page: a row for each fault, a cell for each of `heads`."""
    text = open(page).read()
    start = text.index("| fault |", text.index(head))
    end = text.find("\n\n", start)
    lines = ["| fault | " + " | ".join(heads) + " |", "|---" * (1 + len(heads)) + "|"]
    lines += [f"| {fault} | " + " | ".join(of.get(column, "–") for column in heads) + " |" for fault, of in cells.items()]
    open(page, "w").write(text[:start] + "\n".join(lines) + (text[end:] if end >= 0 else "\n"))


def found(program):
    for motor in MOTORS:
        _, text = studies(program, motor, ["bipolar", "maximum-likelihood"], 3000)
        open(f"{ROOT}/docs/notes/faults-{motor}.csv", "w", newline="").write(text)
        print(f"{motor}: measured", flush=True)
    page(program)


def page(_):
    """The table of docs/faults.md from the files of all motors, and what its text says of them."""
    cells, heads = {}, []
    for motor in MOTORS:
        if not os.path.exists(f"{ROOT}/docs/notes/faults-{motor}.csv"):
            continue
        rows = list(csv.DictReader(open(f"{ROOT}/docs/notes/faults-{motor}.csv", newline="")))
        for row in rows:
            if row["begins"] not in ("", "before"):
                continue
            reason = SHORT.get(row["detected_by"], row["detected_by"])
            if float(row["undetermined"]) > 0.5 * float(row["detected"]):
                reason = "pole open"
            said = cell(row, True) + (f" {reason}" if float(row["detected"]) else "")
            column = f"`{motor}`, `{row['method']}`"
            heads += [] if column in heads else [column]
            cells.setdefault(name(row), {})[column] = said
        for begins in ("", "before", "during", "50 us"):
            of = [row for row in rows if row["begins"] == begins]
            print(f"{motor}, {begins}: {sum(float(row['wrong_pole']) == 0 for row in of)} of {len(of)} rows without a wrong pole", flush=True)
            for row in of:
                if float(row["wrong_pole"]) or float(row["right_pole_beyond_limit"]) or not begins and float(row["detected"]):
                    print(f"  {row['method']} {row['failure_mode']}: {row['wrong_pole']} wrong, {row['right_pole_beyond_limit']} beyond, {row['detected']} detected", flush=True)
    written(f"{ROOT}/docs/faults.md", "Shares of the starts in per cent", heads, cells)


def methods(program):
    page = f"{ROOT}/docs/notes/faults-methods.md"
    for motor in MOTORS:
        first = studies(program, motor, METHODS[0], 300, ["--begins", "before"])[0]
        second = study(program, motor, METHODS[1], 300, ["--begins", "before", *OTHERS])[0]
        capacitance, resistance = MOTORS[motor]
        link = [*OTHERS, "-s", f"inverter.capacitance={capacitance}", "-s", f"inverter.source_resistance={resistance}", "-s", "sensors.bandwidth=200 kHz"]
        modes = [word for mode in MORE[:4] for word in ("--mode", mode)]
        third = study(program, motor, METHODS[1], 300, ["--begins", "before", *link, *modes])[0]
        for row in third:
            row["failure_mode"] = row["failure_mode"].replace("as it is", "as it is with more parts")
        aligned = studies(program, motor, METHODS[2], ALIGNED, ["--begins", "before", *FREE])[0]
        cells = {}
        for row in [*first, *second, *third, *aligned]:
            mode, method = row["failure_mode"], row["method"]
            text = cell(row, False)
            if mode == "sample-late" and method in AT_END:
                text = "–"
            if mode.startswith("current") and method in WITHOUT_CURRENT:
                text = "not read"
            cells.setdefault(name(row), {})[method] = text
        written(page, f"## `{motor}`", [method for group in METHODS for method in group], cells)
        print(f"{motor}: {len(cells)} faults", flush=True)


def main():
    program, parts = os.path.abspath(sys.argv[1]), sys.argv[2:] or ["found", "methods"]
    for part in parts:
        {"found": found, "page": page, "methods": methods}[part](program)


main()
