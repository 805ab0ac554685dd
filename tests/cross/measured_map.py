#!/usr/bin/env python3
"""A measured flux map of a motor that is known: writes ../../examples/maps/measured.csv.

The core of scipy_pulses.py at ±10 A, 1 A apart, with half a milliweber of noise on each flux, a thousandth of what there is.
Standard library only.
"""

import random

NOISE = 0.5e-3


def bisected(current, wanted):
    """The flux at which a current that rises with it is the wanted one."""
    low, high = -2.0, 2.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if current(middle) < wanted else (low, middle)
    return (low + high) / 2


random.seed(1)
with open("../../examples/maps/measured.csv", "w") as out:
    out.write("i_d_A,i_q_A,psi_d_Wb,psi_q_Wb\n")
    for i_d in range(-10, 11):
        for i_q in range(-10, 11):
            psi_d = bisected(lambda x: (89.14 + 43.0 * abs(x) ** 5) * x - 40.47, i_d)
            psi_q = bisected(lambda x: (59.0 + 40.0 * x * x) * x, i_q)
            read = [psi + random.gauss(0, NOISE) for psi in (psi_d, psi_q)]
            out.write(f"{i_d},{i_q},{read[0]:.5f},{read[1]:.5f}\n")
