#!/usr/bin/env python3
"""Makes the table from the lines `name,simulated seconds per second,error in A[,error to the real problem in A]`.

    table.py LINES FOLDER      prints it; writes comparison.md and comparison.csv
"""

import csv
import pathlib
import sys

from problem import largest, reference

# What each program models, and what it does not, by how a line's name begins.
MODELS = {
    "standstill three": "all of it",
    "standstill line": "the paper's detection: also ripple, gate delays, sensors; error: readings, against 1e-14 Wb",
    "fixed steps": "all of it, written for this one sequence",
    "ngspice": "all of it; each device with a junction of 2.1 mV",
    "SciPy": "all of it, written for this one sequence",
    "gym-electric-motor": "no saturation, no drops, no open leg (c is low)",
}
PULSES, DETECTION, FAST = "standstill three pulses", "standstill line-inductance", "standstill line-inductance-fast"


def digits(x):
    """Two significant ones, without an exponent where that is readable."""
    return f"{float(f'{x:.1e}'):,.10g}" if 1e-3 <= x < 1e9 else f"{x:.1e}"


def main():
    lines, folder = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    rates, errors = {}, {}
    for name, rate, *rest in csv.reader(lines.read_text().splitlines()):
        rates[name] = max(rates.get(name, 0.0), float(rate))
        errors[name] = [float(error) for error in rest]
    scale = largest(reference())
    assert {PULSES, DETECTION, FAST} <= rates.keys(), lines

    heads = ["", "models", "s simulated per s", "error, A", "error, %", "pulses ÷ it", "detection ÷ it", "fast decay ÷ it"]
    table, rows = [heads, ["---"] * len(heads)], []
    for name, rate in rates.items():
        models = next(text for start, text in MODELS.items() if name.startswith(start))
        ratios = [rates[ours] / rate for ours in (PULSES, DETECTION, FAST)]
        # Of a simplified problem: against its own exact solution, then against the real problem.
        amperes = ", ".join(f"{error:.1e}" for error in errors[name])
        percent = ", ".join(digits(100 * error / scale) for error in errors[name])
        theirs = not name.startswith("standstill")
        table.append([name, models, digits(rate), amperes, percent, *(digits(x) if theirs else "" for x in ratios)])
        rows.append([name, models, rate, errors[name][0], errors[name][-1], *ratios])

    slow = max(rate for name, rate in rates.items() if name.startswith("ngspice 1 µs"))
    gem = {tau: max(r for n, r in rates.items() if n.startswith("gym") and f" {tau} µs" in n) for tau in (1, 80)}
    text = "\n".join("| " + " | ".join(row) + " |" for row in table) + "\n\n"
    text += f"The largest current is {scale:.2f} A. The paper's detection (slow decay, with fast decay) against\n\n"
    for what, rate, asked in [
        ("ngspice at 1 µs", slow, "10,000"),
        ("gym-electric-motor at 1 µs", gem[1], "20,000"),
        ("gym-electric-motor at 80 µs, no dead time", gem[80], "20,000"),
    ]:
        text += f"* {what}: {digits(rates[DETECTION] / rate)}, {digits(rates[FAST] / rate)} (asked: {asked})\n"
    print(text, end="")
    (folder / "comparison.md").write_text(text)
    with open(folder / "comparison.csv", "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        numbers = ["simulated_s_per_s", "error_A", "error_to_real_problem_A"]
        ratios = ["pulses_ratio", "detection_ratio", "fast_detection_ratio"]
        writer.writerow(["name", "models", *numbers, *ratios])
        writer.writerows(rows)


if __name__ == "__main__":
    main()
