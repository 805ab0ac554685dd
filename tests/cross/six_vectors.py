#!/usr/bin/env python3
"""Reads scipy_pulses.csv with a scope of eight bits at ±8 A: writes ../../examples/traces/six_vectors.csv.

Half a step of noise, channels whose gains differ by parts of a per cent about 1, offsets of tens of milliamperes, a
trigger that is not the first edge. Standard library only.
"""

import random

VECTORS = ["HLL", "LHH", "LHL", "HLH", "LLH", "HHL"]
WORDS = {"H": "high", "L": "low"}
STEP = 8 / 128
GAIN, OFFSET = [1.004, 0.995, 1.001], [0.05, -0.03, 0.02]
LEAD, ON, PERIOD = 20e-6, 230e-6, 550e-6

random.seed(1)
rows = [[float(x) for x in line.split(",")] for line in open("scipy_pulses.csv").read().splitlines()[1:]]
with open("../../examples/traces/six_vectors.csv", "w") as out:
    out.write("t_s,i_a_A,i_b_A,i_c_A,u_dc_V,leg_a,leg_b,leg_c\n")
    for time, *currents in rows[::2]:
        k = int((time - LEAD) // PERIOD) if time > LEAD else -1
        on = k >= 0 and time - LEAD - k * PERIOD < ON
        legs = [WORDS[letter] for letter in VECTORS[k]] if on else ["off"] * 3
        read = [g * i + o + random.gauss(0, 0.5 * STEP) for g, i, o in zip(GAIN, currents, OFFSET)]
        codes = [f"{round(x / STEP) * STEP:.6f}" for x in read]
        out.write(f"{time - 1.3e-4:.9f},{','.join(codes)},{550 + random.gauss(0, 0.3):.1f},{','.join(legs)}\n")
