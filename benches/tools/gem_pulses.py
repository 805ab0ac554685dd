#!/usr/bin/env python3
"""The nearest that gym-electric-motor can do: all legs driven, no drops, a linear motor. Prints time and errors.

Its bridge has no leg that is truly off: an open leg is at one rail or the other by the sign of its current, also with no
current at all. So leg c is low throughout, and with b low too a pulse is the voltage vector along a. The motor is
paper-5k5 as it is at rest, with constant L_d and L_q. What a step of the environment adds (rewards, references, limits)
is left out: only the physical system is stepped.
"""

import math
import sys
import time

import gym_electric_motor.physical_systems as systems
import numpy as np
from gym_electric_motor.physical_systems import solvers
from scipy.linalg import expm

from problem import A_D0, A_DD, A_Q0, DEAD, END, PERIOD, PULSE, PULSES, RESISTANCE, SAMPLES, THETA, U_DC
from problem import error, reference, rest_flux

L_D = 1.0 / (A_D0 + 6.0 * A_DD * rest_flux() ** 5)
L_Q = 1.0 / A_Q0
# Actions of the bridge: a high, b and c low; all low.
A_HIGH, ALL_LOW = 4, 0


def exact(dead_time):
    """The simplified problem in closed form: each axis is an exponential while the voltage is constant."""
    rows = []
    current = np.zeros(2)
    decay = np.diag([-RESISTANCE / L_D, -RESISTANCE / L_Q])
    final = np.array([math.cos(THETA), -math.sin(THETA)]) * (2.0 / 3.0 * U_DC / RESISTANCE)

    def after(duration, start, target):
        return target + expm(decay * duration) @ (start - target)

    for k in range(PULSES):
        begin = after(dead_time, current, 0.0)
        end = after(PULSE - dead_time, begin, final)
        rows += [phases(*after(t - k * PERIOD - PULSE, end, 0.0)) for t in SAMPLES[6 * k : 6 * k + 6]]
        current = after(PERIOD - PULSE, end, 0.0)
    return rows


def phases(d, q):
    return [d * math.cos(THETA - x) - q * math.sin(THETA - x) for x in (0.0, 2.0 * math.pi / 3.0, -2.0 * math.pi / 3.0)]


def system(tau, solver, interlocking):
    motor = systems.PermanentMagnetSynchronousMotor(
        motor_parameter={"p": 4, "l_d": L_D, "l_q": L_Q, "r_s": RESISTANCE, "psi_p": rest_flux(), "j_rotor": 0.02},
        limit_values={"i": 20.0, "u": U_DC, "omega": 100.0},
        nominal_values={"i": 8.0, "u": U_DC, "omega": 100.0},
        motor_initializer={
            "states": {"i_sd": 0.0, "i_sq": 0.0, "epsilon": THETA},
            "interval": None,
            "random_init": None,
            "random_params": (None, None),
        },
    )
    return systems.SynchronousMotorSystem(
        converter=systems.FiniteB6BridgeConverter(tau=tau, interlocking_time=interlocking),
        motor=motor,
        load=systems.ConstantSpeedLoad(omega_fixed=0.0),
        supply=systems.IdealVoltageSupply(U_DC),
        ode_solver=solver,
        tau=tau,
    )


def simulate(bench, tau, dead_in_actions):
    """Phase currents at the samples."""
    first = bench.state_names.index("i_a")
    limits = np.array(bench.limits[first : first + 3])
    # A new bridge has all legs off, and a leg that was off is not delayed by the dead time.
    bench.reset()
    bench.simulate(ALL_LOW)
    bench.reset()
    steps, period, pulse = round(END / tau), round(PERIOD / tau), round(PULSE / tau)
    late = round(DEAD / tau) if dead_in_actions else 0
    samples = {round(t / tau) for t in SAMPLES}
    rows = []
    for k in range(steps):
        state = bench.simulate(A_HIGH if late <= k % period < pulse else ALL_LOW)
        if k + 1 in samples:
            rows.append(list(state[first : first + 3] * limits))
    return rows


def main():
    real = reference()
    repetitions = int(sys.argv[1]) if len(sys.argv) > 1 else 3

    def dopri5():
        return solvers.ScipyOdeSolver("dopri5", rtol=1e-6, atol=1e-9)

    # How the dead time is had: from the actions, in steps of which it is a multiple; from the bridge; not at all.
    choices = [
        ("Euler", solvers.EulerSolver, 1e-6, "actions"),
        ("Euler", solvers.EulerSolver, 2e-6, "actions"),
        ("dopri5", dopri5, 2e-6, "actions"),
        ("dopri5", dopri5, 10e-6, "bridge"),
        ("dopri5", dopri5, 80e-6, "none"),
    ]
    for name, solver, tau, dead_time in choices:
        bench = system(tau, solver(), DEAD if dead_time == "bridge" else 0.0)
        best = math.inf
        for _ in range(repetitions):
            begin = time.perf_counter()
            rows = simulate(bench, tau, dead_time == "actions")
            best = min(best, time.perf_counter() - begin)
        own = exact(0.0 if dead_time == "none" else DEAD)
        how = {"actions": "dead time in actions", "bridge": "dead time of bridge", "none": "no dead time"}[dead_time]
        print(f"gym-electric-motor {name} {tau * 1e6:g} µs {how},{END / best:.6g},{error(rows, own):.3g},{error(rows, real):.3g}")


if __name__ == "__main__":
    main()
