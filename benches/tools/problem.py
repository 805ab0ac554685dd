"""The problem that all programs solve, in numbers, and what their results are measured against.

    0          2 µs                80 µs      82 µs                        2400 µs     × 3
    | dead time | a high, b low     | a's upper switch is off                  |
    |           | leg c off         | a's lower diode, b's lower switch: freewheel; leg c may join through its diode
"""

import csv
import math
import pathlib

HERE = pathlib.Path(__file__).resolve().parent

U_DC = 550.0
PULSE, PERIOD, DEAD, PULSES = 80e-6, 2400e-6, 2e-6, 3
END = PULSES * PERIOD
# V and Ω.
SWITCH, DIODE = (0.9, 50e-3), (1.0, 30e-3)

# The motor paper-5k5: i_d = (A_D0 + A_DD |ψ_d|^5) ψ_d − I_F, i_q = A_Q0 ψ_q.
RESISTANCE = 1.2
A_D0, A_DD, A_Q0, I_F = 89.14, 43.0, 59.0, 40.47
THETA = math.radians(20.0)

# In s: the end of each on-time and five instants of each freewheel.
SAMPLES = [round((period * 2400 + 80 + 400 * k) * 1e-6, 9) for period in range(PULSES) for k in range(6)]


def reference():
    """Phase currents in A at the samples."""
    with open(HERE / "reference.csv", newline="") as file:
        rows = [[float(value) for value in row] for row in list(csv.reader(file))[1:]]
    assert all(abs(row[0] - t) < 1e-12 for row, t in zip(rows, SAMPLES, strict=True))
    return [row[1:] for row in rows]


def largest(rows):
    return max(abs(value) for row in rows for value in row)


def error(rows, exact):
    """The largest deviation of a current at any sample, in A."""
    return max(abs(x - y) for row, other in zip(rows, exact, strict=True) for x, y in zip(row, other, strict=True))


def rest_flux():
    """ψ_d without current, by Newton's method."""
    psi = 0.45
    for _ in range(20):
        psi -= ((A_D0 + A_DD * psi**5) * psi - I_F) / (A_D0 + 6.0 * A_DD * psi**5)
    return psi
