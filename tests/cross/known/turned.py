#!/usr/bin/env python3
"""Pulses of one motor with eddy currents at two angles of the rotor, north and south of phase a: writes ../../../examples/traces/turned/.

Shares no code with the simulator: SciPy's DOP853 at a relative tolerance of 1e-11 (pip install numpy scipy). The motor is made up, of the size of a
small servo on 36 V: psi is the flux beside the magnet's, chi the flux that the eddy currents hold back,
    dpsi/dt = u - R i,  dchi/dt = (psi - chi)/tau,  i = psi/L (1 + b x + c x^2) + G (psi - chi),  x = psi/(L I),  G = k/((1 - k) L),
saturating (b, c) along d alone. Along phase a, then along b, +75 us, -150 us, +75 us, then all legs low. Edges lie between the rows.
"""

import math
import pathlib
import random

import numpy as np
from scipy.integrate import solve_ivp

OUT = pathlib.Path(__file__).resolve().parents[3] / "examples/traces/turned"
R, L_D, L_Q, LINK = 0.45, 160e-6, 190e-6, 36.0
TAU, DEPTH = 8e-6, (0.40, 0.30)
RATED, B, C = 12.0, 0.02, 0.005
STEP, INTERVAL, TRAIN = 12.5 / 2048, 5e-6, 900e-6
EDGES = [(76.1e-6, 1), (150.3e-6, -1), (300.9e-6, 1), (375.4e-6, 0)]


def currents(state):
    psi, chi = state[:2], state[2:]
    x = psi[0] / (L_D * RATED)
    static = np.array([psi[0] / L_D * (1.0 + B * x + C * x * x), psi[1] / L_Q])
    g = np.array([k / ((1.0 - k) * l) for k, l in zip(DEPTH, (L_D, L_Q))])
    return static + g * (psi - chi)


def train(angle, phase, state):
    """The phase currents at each row of one train, the rotor at an electrical angle in degrees, and the fluxes at its end."""
    times = np.arange(0.0, TRAIN - 1e-12, INTERVAL)
    rows, begin = [], 0.0
    axes = [math.radians(angle) - 2.0 * math.pi / 3.0 * k for k in range(3)]
    for end, level in zip([at for at, _ in EDGES] + [TRAIN], [0] + [level for _, level in EDGES]):
        u = 2.0 / 3.0 * LINK * level * np.array([math.cos(axes[phase]), -math.sin(axes[phase])])
        slope = lambda _, y: np.concatenate([u - R * currents(y), (y[:2] - y[2:]) / TAU])
        at = times[(times >= begin) & (times < end)]
        run = solve_ivp(slope, (begin, end), state, method="DOP853", rtol=1e-11, atol=1e-14, t_eval=np.append(at, end))
        rows += [currents(y) for y in run.y.T[: len(at)]]
        state, begin = run.y.T[-1], end
    return state, times, [[i[0] * math.cos(a) - i[1] * math.sin(a) for a in axes] for i in rows]


def legs(phase, level):
    """Along a phase its own leg is high, against it the two others are."""
    return ",".join("high" if level != 0 and (k == phase) == (level > 0) else "low" for k in range(3))


def write(name, angle, seed):
    draw = random.Random(seed)
    with open(OUT / f"{name}.csv", "w") as file:
        file.write("t_s,i_a_A,i_b_A,i_c_A,u_dc_V,leg_a,leg_b,leg_c,angle_deg\n")
        state = np.zeros(4)
        for phase in range(2):
            state, times, rows = train(angle, phase, state)
            for time, row in zip(times, rows):
                level = next((level for at, level in reversed(EDGES) if time >= at), 0)
                read = [STEP * round((i + draw.gauss(0.0, 0.4 * STEP)) / STEP) for i in row]
                at = phase * TRAIN + time
                file.write(f"{at:.7f},{','.join(f'{i:.6g}' for i in read)},{LINK:g},{legs(phase, level)},{angle:g}\n")


OUT.mkdir(parents=True, exist_ok=True)
write("north", 4.0, 1)
write("south", 184.0, 2)
