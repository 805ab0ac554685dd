#!/usr/bin/env python3
"""Writes the measured pulses of Szalay and Fodor as traces that `standstill fit` reads: szalay.py FOLDER OUT.

FOLDER: slva_prj of a copy of github.com/Szalay/QS-SLVA (a31810d0), which has them as pairs of time and value; no licence is stated there. ap: +75, -150, +75 us along
phase a, an: with the other sign; _0 with the magnet along phase a, _100 against it. Commands change at 75, 150, 300 and 375 us; the currents' corners lie 1 to 2 us later,
before the next row, so the legs change with that row. (The measured voltages, means of several samples, change up to a row before or after the currents.)
"""

import pathlib
import sys

folder, out = map(pathlib.Path, sys.argv[1:3])
out.mkdir(parents=True, exist_ok=True)


def values(name):
    return [tuple(map(float, line.split())) for line in (folder / f"swi_{name}.txt").read_text().splitlines() if line.strip()]


EDGES = [(75e-6, 1), (150e-6, -1), (300e-6, 1), (375e-6, 0)]
LEGS = {0: "low,low,low", 1: "high,low,low", -1: "low,high,high"}
for sign in ("ap", "an"):
    for position, angle in (("0", 0), ("100", 180)):
        phases = [values(f"i_{phase}_{sign}_{position}") for phase in "abc"]
        with open(out / f"{sign}_{position}.csv", "w") as file:
            file.write("t_s,i_a_A,i_b_A,i_c_A,u_dc_V,leg_a,leg_b,leg_c,angle_deg\n")
            for k, (time, _) in enumerate(phases[0]):
                level = next((level for at, level in reversed(EDGES) if time > at + 1e-9), 0) * (1 if sign == "ap" else -1)
                currents = ",".join(str(phase[k][1]) for phase in phases)
                file.write(f"{time:.7f},{currents},36,{LEGS[level]},{angle}\n")
