#!/usr/bin/env python3
"""Six voltage vectors and their decays through the diodes, a saturated core, the rotor held: writes scipy_pulses.csv.

DOP853 at a relative tolerance of 1e-11 (pip install scipy). All legs are switched on together after the dead time and
off together; while they are on, every current flows through a switch, afterwards through a diode until it ends. Each
current has one direction only, so that which device conducts needs no search; that it is so is asserted.
"""

import math

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

U = 550.0
R = 1.2
THETA = math.radians(40.0)
A_D0, A_DD, A_Q0, A_QQ, I_F = 89.14, 43.0, 59.0, 40.0, 40.47
SWITCH, DIODE = (0.9, 0.05), (1.0, 0.03)
DEAD = 2e-6
LEAD, ON, PERIOD = 20e-6, 230e-6, 550e-6
VECTORS = [(1, 0, 0), (0, 1, 1), (0, 1, 0), (1, 0, 1), (0, 0, 1), (1, 1, 0)]
STEP = 1e-6
FIRST = 0.5e-6

COS, SIN, ROOT = math.cos(THETA), math.sin(THETA), math.sqrt(3.0)
PARK = np.array([[COS, SIN], [-SIN, COS]])
CLARKE = np.array([[2.0, -1.0, -1.0], [0.0, ROOT, -ROOT]]) / 3.0
AXES = np.array([[1.0, 0.0], [-0.5, ROOT / 2.0], [-0.5, -ROOT / 2.0]])


def currents(y):
    d, q = y
    i = np.array([(A_D0 + A_DD * abs(d) ** 5) * d - I_F, (A_Q0 + A_QQ * q * q) * q])
    return AXES @ (PARK.T @ i)


def gamma(y):
    d, q = y
    return PARK.T @ np.diag([A_D0 + 6.0 * A_DD * abs(d) ** 5, A_Q0 + 3.0 * A_QQ * q * q]) @ PARK


def slope(y, potentials, blocked):
    """dψ/dt in the rotor's plane; a blocked leg's potential is what keeps its current."""
    i = currents(y)
    driven = CLARKE @ potentials - R * (CLARKE @ i)
    if blocked is not None:
        g = gamma(y)
        across = AXES[blocked] @ g
        shift = -(across @ driven) / (across @ CLARKE[:, blocked])
        driven = driven + CLARKE[:, blocked] * shift
        potential = potentials[blocked] + shift
        assert -DIODE[0] < potential < U + DIODE[0], potential
    return PARK @ driven


def on(legs):
    signs = np.array([1.0 if leg else -1.0 for leg in legs])

    def f(_, y):
        i = currents(y)
        v = np.where(signs > 0, U - SWITCH[0] - SWITCH[1] * i, SWITCH[0] - SWITCH[1] * i)
        return slope(y, v, None)

    return f


def decay(signs, blocked):
    def f(_, y):
        i = currents(y)
        v = np.where(signs > 0, -DIODE[0] - DIODE[1] * i, U + DIODE[0] - DIODE[1] * i)
        if blocked is not None:
            v[blocked] = U / 2.0
        return slope(y, v, blocked)

    return f


def piece(f, start, end, y, wanted, rows, events=()):
    """Goes on to the end or to an event; the currents at the wanted times become rows."""
    done = solve_ivp(f, (start, end), y, "DOP853", dense_output=True, rtol=1e-11, atol=1e-13, events=events or None)
    assert done.success, done.message
    stop = done.t[-1]
    for t in wanted:
        if start < t <= stop:
            rows.append([t, *currents(done.sol(t))])
    which = next((k for k, times in enumerate(done.t_events or []) if len(times)), None)
    return stop, done.y[:, -1], which


def main():
    rest = [brentq(lambda d: (A_D0 + A_DD * d**5) * d - I_F, 0.1, 1.0, xtol=1e-16), 0.0]
    rows = []
    count = round((LEAD + PERIOD * len(VECTORS)) / STEP)
    grid = [FIRST + STEP * k for k in range(count)]
    for number, legs in enumerate(VECTORS):
        start = LEAD + number * PERIOD
        signs = np.array([1.0 if leg else -1.0 for leg in legs])
        before = [t for t in grid if (0.0 if number == 0 else start) < t <= start + DEAD]
        rows += [[t, 0.0, 0.0, 0.0] for t in before]
        t, y, _ = piece(on(legs), start + DEAD, start + ON, rest, grid, rows)
        assert all(currents(y) * signs > 0), currents(y)
        blocked = None
        while True:
            left = [k for k in range(3) if k != blocked]

            def ends(k):
                def event(_, y):
                    return currents(y)[k] * signs[k] + 1e-12

                event.terminal, event.direction = True, -1
                return event

            t, y, which = piece(decay(signs, blocked), t, start + PERIOD, y, grid, rows, [ends(k) for k in left])
            assert which is not None, "a current goes on"
            if blocked is not None:
                break
            blocked = left[which]
        rows += [[at, 0.0, 0.0, 0.0] for at in grid if t < at <= start + PERIOD]
    with open("scipy_pulses.csv", "w") as file:
        file.write("t_s,i_a_A,i_b_A,i_c_A\n")
        for row in rows:
            file.write(f"{row[0]:.7f}," + ",".join(f"{x + 0.0:.6f}" for x in row[1:]) + "\n")


main()
