#!/usr/bin/env python3
"""Play cells in the stator's iron, a saturated core, a light rotor that turns: writes scipy_hysteresis.csv.

DOP853 at a relative tolerance of 1e-12 (pip install scipy), in the stator's frame, the sequence of scipy_reference.py.
Each cell has a pinned flux of its own among the unknowns. It is stuck, or slides along the force; solve_ivp's events
end a mode where the force reaches its threshold, and where the flux turns back.
"""

import csv
import math

import numpy as np
from scipy.integrate import solve_ivp

from scipy_reference import INTERVAL, SEQUENCE, U, paper, rest_flux

RESISTANCE, POLE_PAIRS, INERTIA, ANGLE = 1.2, 4, 1e-3, 0.7
# 2 % of the rated 8 A, 5 % of the smaller inductance, three cells: equally stiff, reaching 1/3, 1 and 5/3 of the mean.
COERCIVE, DEPTH, CELLS = 0.16, 0.05, 3


def core_current(y):
    sin, cos = math.sin(y[2]), math.cos(y[2])
    d, q = paper(cos * y[0] + sin * y[1], cos * y[1] - sin * y[0])
    return np.array([cos * d - sin * q, sin * d + cos * q])


def cells():
    flux = rest_flux(paper)
    least = 1.0 / max(89.14 + 6 * 43.0 * flux**5, 59.0)
    stiffness = DEPTH / ((1 - DEPTH) * least)
    reach = COERCIVE / stiffness
    return stiffness / CELLS, [reach * (2 * k + 1) / CELLS for k in range(CELLS)]


STIFFNESS, REACH = cells()


def elastic(y):
    return [y[:2] - y[4 + 2 * k : 6 + 2 * k] for k in range(CELLS)]


def current(y):
    return core_current(y) + STIFFNESS * sum(elastic(y))


def slope(_, y, v, slides):
    core = core_current(y)
    torque = 1.5 * POLE_PAIRS * (y[0] * core[1] - y[1] * core[0])
    rise = v - RESISTANCE * current(y)
    pinned = []
    for e, sliding in zip(elastic(y), slides):
        n = e / np.linalg.norm(e) if sliding else np.zeros(2)
        pinned.append(n * (n @ rise))
    return np.concatenate([rise, [y[3], POLE_PAIRS * torque / INERTIA], *pinned])


def piece(v, y, start, end, slides, times):
    """Goes on to the end or to the end of a mode; the state there, and those at the times in between."""
    events = []
    for k in range(CELLS):
        if slides[k]:
            event = lambda t, y, v, slides, k=k: elastic(y)[k] @ slope(t, y, v, slides)[:2]
            event.direction = -1
        else:
            event = lambda t, y, v, slides, k=k: np.linalg.norm(elastic(y)[k]) / REACH[k] - 1.0
            event.direction = 1
        event.terminal = True
        events.append(event)
    done = solve_ivp(
        slope, (start, end), y, "DOP853", args=(v, slides), events=events, dense_output=True, rtol=1e-12, atol=1e-14, max_step=5e-6
    )
    assert done.success, done.message
    stop, y = done.t[-1], done.y[:, -1]
    ended = next((k for k in range(CELLS) if len(done.t_events[k])), None)
    rows = [(t, done.sol(t) if t < stop else y) for t in times if start < t <= stop]
    return stop, y, ended, rows


def main():
    flux = rest_flux(paper)
    rest = [flux * math.cos(ANGLE), flux * math.sin(ANGLE)]
    y = np.array([*rest, ANGLE, 0.0, *(rest * CELLS)])
    begin, rows, slid, ends = 0.0, [], 0.0, 0
    slides = [False] * CELLS
    for legs, duration in SEQUENCE:
        a, b, c = (U * leg for leg in legs)
        v = np.array([(2 * a - b - c) / 3, (b - c) / math.sqrt(3)])
        times = [duration * (k + 1) / round(duration / INTERVAL) for k in range(round(duration / INTERVAL))]
        # A new voltage may turn the flux back, or take it further.
        rise = v - RESISTANCE * current(y)
        at_reach = [np.linalg.norm(e) > (1 - 1e-9) * r for e, r in zip(elastic(y), REACH)]
        slides = [bool(at and e @ rise > 0) for at, e in zip(at_reach, elastic(y))]
        now = 0.0
        while now < duration:
            now, y, ended, more = piece(v, y, now, duration, slides, times)
            for t, there in more:
                i = current(there)
                half, root = -i[0] / 2, math.sqrt(3) / 2 * i[1]
                rows.append([begin + t, i[0], half + root, half - root, there[2], there[3]])
            if ended is not None:
                slides[ended] = not slides[ended]
                ends += 1
        begin += duration
    with open("scipy_hysteresis.csv", "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["t_s", "i_a_A", "i_b_A", "i_c_A", "theta_rad", "omega_rad_per_s"])
        writer.writerows([[f"{value:.15e}" for value in row] for row in rows])
    print(f"{ends} modes of cells ended")


main()
