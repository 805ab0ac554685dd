#!/usr/bin/env python3
"""Reference runs with SciPy's DOP853 at a relative tolerance of 1e-13 (pip install scipy): writes scipy_*.csv.

A saturated core, a light rotor that turns, and a bridge of ideal switches with all three legs driven, so that the
terminal voltages are known without any conduction logic: everything here is written from the equations, nothing is
taken from the program that is checked.
"""

import csv
import math

from scipy.integrate import solve_ivp

U = 550.0
# Legs a, b, c (1: high) and how long, in s: starts, reversals and short circuits.
SEQUENCE = [
    ((1, 0, 0), 300e-6),
    ((0, 1, 0), 400e-6),
    ((0, 0, 0), 2e-3),
    ((1, 1, 0), 250e-6),
    ((0, 0, 1), 300e-6),
    ((0, 1, 1), 150e-6),
    ((1, 1, 1), 1.6e-3),
]
INTERVAL = 50e-6


def paper(d, q):
    """i_d, i_q of the motor paper-5k5."""
    return (89.14 + 43.0 * abs(d) ** 5) * d - 40.47, 59.0 * q


def pm_reluctance(d, q):
    """i_d, i_q of the motor pm-reluctance, with its iron bridges."""
    i_d = (3.96 + 28.5 * abs(d) ** 4 + 41.5 / 3 * abs(d) * abs(q) ** 3) * d
    i_q = (5.89 + 2.67 * abs(q) ** 6 + 41.5 / 3 * abs(d) ** 3 * abs(q)) * q
    b = d - 0.804
    s2 = b * b + 0.1 * q * q
    g = 81.75 * s2 / (1 + s2)
    return i_d + g * b, i_q + 0.1 * g * q


def rest_flux(core):
    """ψ_d without current, by bisection."""
    low, high = 0.0, 1.0
    for _ in range(200):
        middle = (low + high) / 2
        if core(middle, 0.0)[0] > 0:
            high = middle
        else:
            low = middle
    return (low + high) / 2


def current(core, y):
    sin, cos = math.sin(y[2]), math.cos(y[2])
    d, q = core(cos * y[0] + sin * y[1], cos * y[1] - sin * y[0])
    return cos * d - sin * q, sin * d + cos * q


def run(name, core, resistance, pole_pairs, inertia, angle):
    def slope(_, y, v_alpha, v_beta):
        i_alpha, i_beta = current(core, y)
        torque = 1.5 * pole_pairs * (y[0] * i_beta - y[1] * i_alpha)
        return [
            v_alpha - resistance * i_alpha,
            v_beta - resistance * i_beta,
            y[3],
            pole_pairs * torque / inertia,
        ]

    flux = rest_flux(core)
    y = [flux * math.cos(angle), flux * math.sin(angle), angle, 0.0]
    start = 0.0
    rows = []
    for legs, duration in SEQUENCE:
        a, b, c = (U * leg for leg in legs)
        v = ((2 * a - b - c) / 3, (b - c) / math.sqrt(3))
        count = round(duration / INTERVAL)
        times = [duration * k / count for k in range(1, count + 1)]
        solution = solve_ivp(slope, (0, duration), y, "DOP853", times, args=v, rtol=1e-13, atol=1e-15)
        assert solution.success, solution.message
        for k, t in enumerate(times):
            y = [solution.y[n][k] for n in range(4)]
            i_alpha, i_beta = current(core, y)
            half, root = -i_alpha / 2, math.sqrt(3) / 2 * i_beta
            rows.append([start + t, i_alpha, half + root, half - root, y[2], y[3]])
        start += duration
    with open(f"scipy_{name}.csv", "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["t_s", "i_a_A", "i_b_A", "i_c_A", "theta_rad", "omega_rad_per_s"])
        writer.writerows([[f"{value:.15e}" for value in row] for row in rows])


if __name__ == "__main__":
    run("paper-5k5", paper, 1.2, 4, 1e-3, 0.7)
    run("pm-reluctance", pm_reluctance, 0.63, 2, 2e-5, 2.0)
