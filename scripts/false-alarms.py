#!/usr/bin/env python3
"""Counts how often a start without any fault ends without an answer, or with a wrong pole.

    python3 scripts/false-alarms.py PROGRAM FOLDER [TRIALS [METHOD ...]]

Each trial draws the inductances and the resistance of the data sheet within ±10 % of the motor's. A run that was interrupted goes on from
FOLDER when the command is given again, also with more TRIALS (3,000,000 without one: none of them shows at most 1e-6, at 95 %). One
thread a run, at the lowest priority. Prints the rows of the table in docs/notes/faults-methods.md.
"""
import json, math, os, subprocess, sys

SCENARIO = """motor = "{motor}"
errors = "{errors}"
[detector]
method = "{method}"
[[faults]]
mode = "sheet-inductance"
magnitude = 1.0
[[faults]]
mode = "sheet-resistance"
magnitude = 1.0
[tolerances]
"faults.0.magnitude" = {{ uniform = "10 %" }}
"faults.1.magnitude" = {{ uniform = "10 %" }}
"""


def run(program, folder, trials, motor, errors, method):
    name = f"{motor}-{errors}-{method}"
    path = f"{folder}/{name}.toml"
    if not os.path.exists(path):
        with open(path, "w") as file:
            file.write(SCENARIO.format(motor=motor, errors=errors, method=method))
    command = ["nice", "-n", "19", program, "run", path, "--trials", str(trials), "--rows", "none", "--resume", "--json", "--threads", "1", "--out", f"{folder}/{name}"]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return json.loads(done.stdout)


def bound(count, trials):
    """The exact one-sided 95 % bound of a probability of which `count` of `trials` came: where so few have 5 %."""
    low, high = 0.0, 1.0
    for _ in range(200):
        p = 0.5 * (low + high)
        few = sum(math.comb(trials, k) * p**k * (1.0 - p) ** (trials - k) for k in range(count + 1)) if 0.0 < p < 1.0 else 0.0
        low, high = (p, high) if few > 0.05 else (low, p)
    return high


def main():
    program, folder = os.path.abspath(sys.argv[1]), sys.argv[2]
    trials = int(sys.argv[3]) if len(sys.argv) > 3 else 3_000_000
    os.makedirs(folder, exist_ok=True)
    for method in sys.argv[4:] or ["bipolar"]:
        for errors in ["default", "field"]:
            found = run(program, folder, trials, "paper-5k5", errors, method)
            of = found["summary"]
            without = of["trials"] - of["found"]
            print(f"| `{method}` | `{errors}` | {found['run']['numerics']} | {of['trials']:,} | {without} | {of['wrong_poles']} | {bound(without, of['trials']):.1e} |", flush=True)


main()
