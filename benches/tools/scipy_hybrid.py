#!/usr/bin/env python3
"""The problem with SciPy's solve_ivp, from the equations: smooth pieces, and events where leg c begins or ends.

    scipy_hybrid.py --reference     writes reference.csv: DOP853 at a relative tolerance of 1e-13
    scipy_hybrid.py                 prints what each choice of method and tolerance takes and how far it is off

While leg c carries nothing, the current of the line a-b is the only unknown, and ψ_d stands for it: i_d alone fixes the
current, and ψ_q = i_q / A_Q0. While it carries current, ψ_d and ψ_q are the unknowns.
"""

import argparse
import csv
import math
import time

from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from problem import (
    A_D0, A_DD, A_Q0, DEAD, DIODE, HERE, I_F, PERIOD, PULSE, PULSES, RESISTANCE, SAMPLES, SWITCH, THETA, U_DC,
    error, reference,
)  # fmt: skip

COS, SIN, ROOT = math.cos(THETA), math.sin(THETA), math.sqrt(3.0)
# i_d and i_q of 1 A into a and out of b.
LINE_D, LINE_Q = COS - SIN / ROOT, -SIN - COS / ROOT


# A piece begins where its event would end it; so the events are a little beyond, in V and A.
ROUNDING = 1e-12


def i_d(psi_d):
    return (A_D0 + A_DD * abs(psi_d) ** 5) * psi_d - I_F


def slope_d(psi_d):
    """di_d/dψ_d in 1/H."""
    return A_D0 + 6.0 * A_DD * abs(psi_d) ** 5


def phases(psi_d, psi_q):
    d, q = i_d(psi_d), A_Q0 * psi_q
    alpha, beta = COS * d - SIN * q, SIN * d + COS * q
    return alpha, (ROOT * beta - alpha) / 2.0, (-ROOT * beta - alpha) / 2.0


def potential_a(high, i_a):
    """Upper switch while the leg is high, lower diode while it is not."""
    return U_DC - SWITCH[0] - SWITCH[1] * i_a if high else -DIODE[0] - DIODE[1] * i_a


def potential_b(i_b):
    return SWITCH[0] - SWITCH[1] * i_b


def two_legs(_, y, high):
    """dψ_d/dt while i_c = 0: the line's flux linkage ψ_a − ψ_b = 3/2 (LINE_D ψ_d + LINE_Q ψ_q) takes the voltage."""
    i = i_d(y[0]) / LINE_D
    voltage = potential_a(high, i) - potential_b(-i) - 2.0 * RESISTANCE * i
    q_over_d = LINE_Q / A_Q0 * slope_d(y[0]) / LINE_D
    return [voltage / (1.5 * (LINE_D + LINE_Q * q_over_d))]


def psi_q_of_line(psi_d):
    return LINE_Q * i_d(psi_d) / LINE_D / A_Q0


def open_potential(t, y, high):
    """Of leg c while it carries nothing: ψ_a, ψ_b and ψ_c add to nothing, and so do the currents."""
    (psi_d_slope,) = two_legs(t, y, high)
    psi_q_slope = LINE_Q / A_Q0 * slope_d(y[0]) / LINE_D * psi_d_slope
    alpha, beta = COS * psi_d_slope - SIN * psi_q_slope, SIN * psi_d_slope + COS * psi_q_slope
    i = i_d(y[0]) / LINE_D
    star = (potential_a(high, i) + potential_b(-i) + (ROOT * beta + alpha) / -2.0) / 2.0
    # The star point follows from a + b alone: v_a + v_b − 2 v_star = d(ψ_a + ψ_b)/dt = −dψ_c/dt.
    return star + (-ROOT * beta - alpha) / 2.0


def diode_begins(t, y, high):
    return open_potential(t, y, high) + DIODE[0] + ROUNDING


def three_legs(_, y, high):
    a, b, c = phases(*y)
    v_a, v_b, v_c = potential_a(high, a), potential_b(b), -DIODE[0] - DIODE[1] * c
    alpha = (2.0 * v_a - v_b - v_c) / 3.0
    beta = (v_b - v_c) / ROOT
    d, q = COS * alpha + SIN * beta, COS * beta - SIN * alpha
    return [d - RESISTANCE * i_d(y[0]), q - RESISTANCE * A_Q0 * y[1]]


def diode_ends(_, y, high):
    return phases(*y)[2] + ROUNDING


diode_begins.terminal = diode_ends.terminal = True
diode_begins.direction = diode_ends.direction = -1


def simulate(method, rtol, atol, max_step=math.inf):
    """Phase currents at the samples, and the events as text."""
    y = [brentq(i_d, 0.0, 1.0, xtol=1e-16, rtol=1e-15)]
    rows, told = [], []
    # The switch of leg a: closed after the dead time, open with the pulse.
    pieces = []
    for k in range(PULSES):
        before = [(k * PERIOD, k * PERIOD + DEAD, False)] if k > 0 else []
        pieces += before + [(k * PERIOD + DEAD, k * PERIOD + PULSE, True), (k * PERIOD + PULSE, (k + 1) * PERIOD, False)]
    for start, end, high in pieces:
        t = start
        while t < end:
            if len(y) == 1 and open_potential(t, y, high) < -DIODE[0]:
                y = [y[0], psi_q_of_line(y[0])]
                told.append(f"{t * 1e6:.4f} us: leg c's lower diode begins")
            slope, ends = (two_legs, diode_begins) if len(y) == 1 else (three_legs, diode_ends)
            within = [s for s in SAMPLES if t < s <= end + 1e-12]
            evaluated = [min(s, end) for s in within] + ([end] if not within or within[-1] < end - 1e-12 else [])
            done = solve_ivp(
                slope, (t, end), y, method, evaluated, args=(high,), events=ends,
                rtol=rtol, atol=atol, max_step=max_step,
            )  # fmt: skip
            assert done.success, done.message
            for k, time_of in enumerate(done.t):
                if any(abs(time_of - s) < 1e-12 for s in within):
                    state = done.y[:, k]
                    rows.append(phases(*state) if len(y) == 2 else phases(state[0], psi_q_of_line(state[0])))
            if done.status == 1:
                t, y = done.t_events[0][0], list(done.y_events[0][0])
                if len(y) == 2:
                    y = y[:1]
                    told.append(f"{t * 1e6:.4f} us: leg c's lower diode ends")
                else:
                    y = [y[0], psi_q_of_line(y[0])]
                    told.append(f"{t * 1e6:.4f} us: leg c's lower diode begins")
            else:
                t, y = end, [float(value) for value in done.y[:, -1]]
    return rows, told


def write_reference():
    # Events are found on the interpolant, which is of a lower order than the steps: so these are short too.
    rows, told = simulate("DOP853", 1e-13, 1e-16, 20e-6)
    other, _ = simulate("Radau", 1e-12, 1e-15, 20e-6)
    with open(HERE / "reference.csv", "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["t_s", "i_a_A", "i_b_A", "i_c_A"])
        # Adding zero turns a rounded −0 into 0.
        writer.writerows([[f"{t:.6f}", *(f"{round(x, 13) + 0.0:.13f}" for x in row)] for t, row in zip(SAMPLES, rows)])
    print("\n".join(told))
    print(f"Radau IIA, of order 5 and implicit, differs by {error(rows, other):.1e} A at most")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--reference", action="store_true")
    if parser.parse_args().reference:
        return write_reference()
    exact = reference()
    for method, rtol in [("RK45", 1e-7), ("RK45", 1e-9), ("DOP853", 1e-9)]:
        best = math.inf
        for _ in range(5):
            begin = time.perf_counter()
            rows, _ = simulate(method, rtol, rtol * 1e-3)
            best = min(best, time.perf_counter() - begin)
        print(f"SciPy {method} rtol {rtol:g},{PULSES * PERIOD / best:.6g},{error(rows, exact):.3g}")


if __name__ == "__main__":
    main()
