#!/usr/bin/env python3
"""Pulses of eight motors as scopes record them, and the truth about each in a second file: writes ../../../examples/traces/known/.

Shares no code and no law of the core with the simulator: fluxes by SciPy's DOP853 at a relative tolerance of 1e-11 (pip install numpy scipy;
SciPy 1.17 made the files), iron by an energy of the fluxes. All legs switch on together after the dead time and off together. While a vector is
on, each current flows through a switch; afterwards through a diode until it ends. That no device conducts the other way is asserted.
The motors are made up, with numbers of the size that such motors have.
"""

import math
import pathlib
import random
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

OUT = pathlib.Path(__file__).resolve().parents[3] / "examples/traces/known"
ROOT = math.sqrt(3.0)
CLARKE = np.array([[2.0, -1.0, -1.0], [0.0, ROOT, -ROOT]]) / 3.0
AXES = np.array([[1.0, 0.0], [-0.5, ROOT / 2.0], [-0.5, -ROOT / 2.0]])
VECTORS = ["HLL", "LHH", "LHL", "HLH", "LLH", "HHL"]
LINES = ["HL-", "LH-", "-HL", "-LH", "L-H", "H-L"]
WORDS = {"H": "high", "L": "low", "-": "off"}
LEAD = 20e-6


class Core:
    """Currents are the slopes of an energy E(ψ_d, ψ_q), so the core is reciprocal; ψ without the magnet's part.

    E = ψ_d²/(2 L_d) + ψ_q²/(2 L_q) + k g(ρ²), ρ² = ((ψ_d + m)/s)² + (ψ_q/s_q)², less the line that makes E stationary at ψ = 0. The inductances
    without current are those wanted, and k is such that L_d falls by the wanted share at the rated current along d.
    """

    LAWS = {
        # g, g' and g'' of z = ρ².
        "cosh": (lambda z: math.sinh(math.sqrt(z)) / (2 * math.sqrt(z)), lambda z: (math.cosh(math.sqrt(z)) - math.sinh(math.sqrt(z)) / math.sqrt(z)) / (4 * z)),
        "cube": (lambda z: 2.0 * z, lambda z: 2.0),
        "steep": (lambda z: 4.0 * z**3, lambda z: 12.0 * z**2),
    }

    def __init__(self, law, l_d, l_q, rated, fall, magnet):
        self.first, self.second = self.LAWS[law]
        self.rest = (l_d, l_q)
        self.scale = l_d * rated
        self.magnet = magnet * self.scale
        # The iron's scale: the magnet alone is near the knee.
        self.s, self.s_q = self.magnet, 1.4 * self.magnet * l_q / l_d
        self.k = 1.0
        self.k = brentq(lambda k: self._with(k).fall((rated, 0.0), 0) - fall, 0.0, self._most(), xtol=1e-14)
        self._with(self.k)

    def _with(self, k):
        self.k = k
        h = self._iron((0.0, 0.0))
        # What is left of 1/L for air and leakage.
        self.air = (1.0 / self.rest[0] - k * h[0, 0], 1.0 / self.rest[1] - k * h[1, 1])
        return self

    def _most(self):
        h = self._iron((0.0, 0.0))
        return 0.98 * min(1.0 / self.rest[0] / h[0, 0], 1.0 / self.rest[1] / h[1, 1])

    def _z(self, y):
        return ((y[0] + self.magnet) / self.s) ** 2 + (y[1] / self.s_q) ** 2

    def _iron(self, y):
        z, p, q = self._z(y), 2.0 * (y[0] + self.magnet) / self.s**2, 2.0 * y[1] / self.s_q**2
        one, two = self.first(z), self.second(z)
        return np.array([[two * p * p + one * 2.0 / self.s**2, two * p * q], [two * p * q, two * q * q + one * 2.0 / self.s_q**2]])

    def currents(self, y):
        z, rest = self._z(y), self._z((0.0, 0.0))
        p = 2.0 / self.s**2
        i_d = self.air[0] * y[0] + self.k * (self.first(z) * p * (y[0] + self.magnet) - self.first(rest) * p * self.magnet)
        i_q = self.air[1] * y[1] + self.k * self.first(z) * 2.0 / self.s_q**2 * y[1]
        return np.array([i_d, i_q])

    def inverse_inductance(self, y):
        return np.diag(self.air) + self.k * self._iron(y)

    def inductance(self, current):
        y = np.zeros(2)
        for _ in range(60):
            y = y - np.linalg.solve(self.inverse_inductance(y), self.currents(y) - np.array(current))
        assert np.allclose(self.currents(y), current, rtol=0.0, atol=1e-9 * abs(sum(current)))
        return np.linalg.inv(self.inverse_inductance(y))

    def fall(self, current, axis):
        return 1.0 - self.inductance(current)[axis, axis] / self.rest[axis]


@dataclass
class Bench:
    name: str
    title: str
    link: float
    resistance: float
    core: Core
    rated: float
    angle: float
    mosfet: bool
    switch: tuple  # V, Ω
    diode: tuple  # V, Ω
    dead: float
    commands: list
    on: float
    # Of the record.
    interval: float
    bits: int
    span: float
    gain: tuple
    offset: tuple  # A
    noise: float  # steps of the converter
    delay: float
    lag: float
    seed: int
    channels: str = "abc"

    def phases(self, y):
        cos, sin = math.cos(math.radians(self.angle)), math.sin(math.radians(self.angle))
        return AXES @ (np.array([[cos, -sin], [sin, cos]]) @ self.core.currents(y))

    def slope(self, y, potentials, blocked):
        """dψ/dt in the rotor's plane; a blocked leg's potential is the one that keeps its current at zero."""
        cos, sin = math.cos(math.radians(self.angle)), math.sin(math.radians(self.angle))
        park = np.array([[cos, sin], [-sin, cos]])
        driven = CLARKE @ potentials - self.resistance * (CLARKE @ self.phases(y))
        if blocked is not None:
            across = AXES[blocked] @ (park.T @ self.core.inverse_inductance(y) @ park)
            shift = -(across @ driven) / (across @ CLARKE[:, blocked])
            driven = driven + CLARKE[:, blocked] * shift
            potential = potentials[blocked] + shift
            assert -self.diode[0] < potential < self.link + self.diode[0], (self.name, potential)
        return park @ driven

    def conducting(self, legs):
        blocked = legs.index("-") if "-" in legs else None

        def f(_, y):
            i = self.phases(y)
            v = np.array([self.link if leg == "H" else 0.0 for leg in legs])
            for k, leg in enumerate(legs):
                if leg == "-":
                    v[k] = self.link / 2.0
                    continue
                forward = 1.0 if leg == "H" else -1.0
                v[k] -= forward * (0.0 if self.mosfet else self.switch[0]) + self.switch[1] * i[k]
                if self.mosfet:
                    assert -forward * i[k] * self.switch[1] < self.diode[0], (self.name, i)
                else:
                    assert forward * i[k] > -1e-9, (self.name, i)
            return self.slope(y, v, blocked)

        return f

    def decaying(self, signs, blocked):
        def f(_, y):
            i = self.phases(y)
            v = np.where(signs > 0, -self.diode[0] - self.diode[1] * i, self.link + self.diode[0] - self.diode[1] * i)
            if blocked is not None:
                v[blocked] = self.link / 2.0
            return self.slope(y, v, blocked)

        return f

    def pulses(self):
        """Pieces of the phase currents (from, to, function of time), and what the legs are asked for from when on."""
        pieces, legs, t = [], [(0.0, "---")], LEAD
        for command in self.commands:
            legs.append((t, command))
            done = piece(self.conducting(command), t + self.dead, t + self.on, np.zeros(2))
            pieces.append((t + self.dead, t + self.on, lambda at, sol=done.sol: self.phases(sol(at))))
            legs.append((t + self.on, "---"))
            y, now = done.y[:, -1], t + self.on
            signs = np.sign(self.phases(y))
            blocked = command.index("-") if "-" in command else None
            while True:
                left = [k for k in range(3) if k != blocked]
                done = piece(self.decaying(signs, blocked), now, now + 20 * self.on, y, [self._end(k, signs[k]) for k in left])
                which = next(k for k, times in zip(left, done.t_events) if len(times))
                pieces.append((now, done.t[-1], lambda at, sol=done.sol: self.phases(sol(at))))
                now, y = done.t[-1], done.y[:, -1]
                if blocked is not None:
                    break
                blocked = which
            t = math.ceil((now + max(30e-6, 0.3 * self.on)) * 1e6) * 1e-6
        return pieces, legs, t

    def _end(self, k, sign):
        def event(_, y):
            return self.phases(y)[k] * sign + 1e-9 * self.rated

        event.terminal, event.direction = True, -1
        return event

    def record(self):
        pieces, legs, end = self.pulses()
        fine = min(self.interval / 8.0, 0.25e-6)
        times = np.arange(0.0, end, fine)
        true = np.zeros((len(times), 3))
        for start, stop, of in pieces:
            inside = (times > start) & (times <= stop)
            true[inside] = np.array([of(t) for t in times[inside]])
        seen = true.copy()
        if self.lag:
            # Exact for straight lines between the fine rows.
            keep = math.exp(-fine / self.lag)
            for n in range(1, len(times)):
                rise = (true[n] - true[n - 1]) / fine
                seen[n] = true[n] - rise * self.lag + (seen[n - 1] - true[n - 1] + rise * self.lag) * keep
        draw = random.Random(self.seed)
        step = self.span / 2 ** (self.bits - 1)
        most = 2 ** (self.bits - 1)
        trigger, t = draw.gauss(0.0, 1e-4), draw.random() * self.interval
        lines = ["t_s," + ",".join(f"i_{c}_A" for c in self.channels) + ",u_dc_V,leg_a,leg_b,leg_c"]
        while t < end - fine:
            asked = next(word for since, word in reversed(legs) if since <= t)
            at = max(t - self.delay, 0.0)
            currents = [np.interp(at, times, seen[:, k]) for k in range(3)]
            read = []
            for channel in self.channels:
                k = "abc".index(channel)
                value = self.gain[k] * currents[k] + self.offset[k] + draw.gauss(0.0, self.noise * step)
                code = min(max(round(value / step), -most), most - 1)
                read.append(f"{code * step:.6g}")
            link = self.link * (1.0 + draw.gauss(0.0, 5e-4))
            lines.append(f"{t + trigger:.8f},{','.join(read)},{link:.5g},{','.join(WORDS[a] for a in asked)}")
            t += self.interval
        (OUT / f"{self.name}.csv").write_text("\n".join(lines) + "\n")
        return len(lines) - 1, true

    def truth(self, true):
        l_d, l_q = self.core.rest
        shares = [n / 8 for n in range(1, 11)]
        axes = [((1.0, 0.0), 0), ((-1.0, 0.0), 0), ((0.0, 1.0), 1)]
        falls = [[self.core.fall((x * s * self.rated, y * s * self.rated), axis) for s in shares] for (x, y), axis in axes]
        number = lambda x: f"{x:.6g}"
        text = f"""# {self.title}. Made up; computed by tests/cross/known/traces.py. SI units, degrees.
[motor]
resistance = {number(self.resistance)}
L_d = {number(l_d)} # incremental, without current
L_q = {number(l_q)}
angle = {number(self.angle)} # electrical, of the north pole's axis from phase a
rated_current = {number(self.rated)}

# 1 - L/L(0), incremental: L_d with a current along d and against it, L_q with one along q.
[falls]
current = [{', '.join(number(s * self.rated) for s in shares)}]
d = [{', '.join(number(f) for f in falls[0])}]
minus_d = [{', '.join(number(f) for f in falls[1])}]
q = [{', '.join(number(f) for f in falls[2])}]

[drive]
link = {number(self.link)}
kind = "{'mosfet' if self.mosfet else 'igbt'}"
switch_drop = {number(0.0 if self.mosfet else self.switch[0])}
switch_resistance = {number(self.switch[1])}
diode_drop = {number(self.diode[0])}
diode_resistance = {number(self.diode[1])}
dead_time = {number(self.dead)}

[record]
bits = {self.bits}
full_scale = {number(self.span)} # either way, A
interval = {number(self.interval)}
gain = [{', '.join(number(g) for g in self.gain)}]
offset = [{', '.join(number(o) for o in self.offset)}] # A
noise = {number(self.noise)} # steps of the converter, rms
delay = {number(self.delay)} # of the channels behind the commands
lag = {number(self.lag)} # time constant of the probes
largest = {number(float(np.abs(true).max()))} # current of a phase, A
"""
        (OUT / f"{self.name}.truth.toml").write_text(text)


def piece(f, start, end, y, events=()):
    done = solve_ivp(f, (start, end), y, "DOP853", dense_output=True, rtol=1e-11, atol=1e-15, events=list(events) or None)
    assert done.success, done.message
    return done


BENCHES = [
    Bench("fan-24v", "A fan on MOSFETs, eight bits", 24.0, 0.45, Core("cosh", 420e-6, 465e-6, 3.0, 0.06, 3.0), 3.0, 131.0, True, (0.0, 0.03), (0.75, 0.02), 0.5e-6,
          VECTORS, 100e-6, 0.8e-6, 8, 4.0, (1.006, 0.997, 1.001), (0.03, -0.02, 0.01), 0.5, 0.6e-6, 0.0, 1),
    Bench("drone-12v", "A drone's motor, two clamps of 100 kHz, eight bits", 12.0, 0.04, Core("cube", 22e-6, 27e-6, 25.0, 0.09, 2.5), 25.0, 303.0, True, (0.0, 0.003), (0.8, 0.002), 0.4e-6,
          VECTORS, 80e-6, 0.5e-6, 8, 40.0, (0.99, 1.012, 1.0), (0.4, -0.2, 0.0), 0.6, 0.3e-6, 1.6e-6, 2, "ab"),
    Bench("hub-36v", "A hub motor, twelve bits", 36.0, 0.09, Core("cosh", 180e-6, 232e-6, 15.0, 0.12, 3.0), 15.0, 17.0, True, (0.0, 0.008), (0.75, 0.006), 0.9e-6,
          VECTORS, 130e-6, 1.3e-6, 12, 25.0, (1.004, 1.001, 0.993), (0.08, 0.05, -0.11), 2.0, 1.1e-6, 0.0, 3),
    Bench("tool-18v", "A power tool's motor, line pulses, twelve bits", 18.0, 0.016, Core("steep", 28e-6, 35e-6, 50.0, 0.15, 3.0), 50.0, 222.0, True, (0.0, 0.0015), (0.7, 0.001), 0.4e-6,
          LINES, 170e-6, 1.0e-6, 12, 80.0, (1.002, 0.996, 1.005), (0.5, -0.3, 0.2), 1.5, 0.4e-6, 0.0, 4),
    Bench("pump-310v", "A pump on IGBTs, eight bits", 310.0, 3.4, Core("cube", 22e-3, 31e-3, 4.0, 0.14, 3.0), 4.0, 78.0, False, (0.9, 0.06), (1.1, 0.05), 2.0e-6,
          VECTORS, 500e-6, 3.0e-6, 8, 6.0, (1.01, 0.995, 0.998), (0.05, -0.02, 0.03), 0.5, 1.5e-6, 0.0, 5),
    Bench("servo-325v", "A servo motor, twelve bits", 325.0, 1.1, Core("steep", 5.1e-3, 6.0e-3, 9.0, 0.08, 4.0), 9.0, 254.0, False, (0.8, 0.04), (0.95, 0.03), 1.5e-6,
          VECTORS, 260e-6, 1.7e-6, 12, 12.0, (0.998, 1.003, 1.001), (0.02, 0.04, -0.03), 2.0, 0.9e-6, 0.0, 6),
    Bench("ipm-560v", "A motor with buried magnets, line pulses, eight bits", 560.0, 0.36, Core("cosh", 6.5e-3, 15e-3, 20.0, 0.18, 2.5), 20.0, 340.0, False, (1.0, 0.02), (1.1, 0.015), 2.0e-6,
          LINES, 500e-6, 3.1e-6, 8, 32.0, (1.005, 1.0, 0.99), (0.2, 0.1, -0.3), 0.5, 2.0e-6, 0.0, 7),
    Bench("traction-700v", "A car's motor, twelve bits", 700.0, 0.008, Core("cosh", 160e-6, 390e-6, 400.0, 0.25, 2.0), 400.0, 163.0, False, (0.9, 0.001), (1.0, 0.0008), 2.5e-6,
          VECTORS, 160e-6, 1.1e-6, 12, 700.0, (1.003, 0.997, 1.001), (2.0, -1.5, 1.0), 2.0, 0.8e-6, 0.0, 8),
]


def main():
    OUT.mkdir(parents=True, exist_ok=True)
    for bench in BENCHES:
        rows, true = bench.record()
        bench.truth(true)
        print(f"{bench.name}: {rows} rows, up to {np.abs(true).max():.4g} A")


main()
