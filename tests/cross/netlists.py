"""Writes the ngspice netlists of `spice/` from `spice/cases.csv`.

A plan is a list of commands, `duration leg_a leg_b leg_c` with the duration in µs and each leg `off`, `low`, `high` or
a duty of the 100 µs carrier. The tests read the same file and give the same commands to the simulation; here they
become the gate signals of six switches.

    python3 netlists.py [longest step in µs]
"""

import csv
import math
import re
import sys
from pathlib import Path

FOLDER = Path(__file__).parent / "spice"
CARRIER = 100e-6
EDGE = 1e-9
# Switches: a resistance, a drop, and a near-ideal diode that blocks the other direction and takes about 7 mV. Diodes likewise.
DEVICES = {
    "ideal": {"switch_drop": 0.0, "switch_resistance": 0.01, "diode_drop": 0.0, "diode_resistance": 0.01},
    "drops": {"switch_drop": 0.9, "switch_resistance": 0.05, "diode_drop": 1.0, "diode_resistance": 0.03},
}


def commands(plan):
    times = re.fullmatch(r"(\d+) x \((.*)\)", plan)
    count, text = (int(times[1]), times[2]) if times else (1, plan)
    steps = [step.split() for step in text.split(";")]
    return [(float(s[0]) * 1e-6, s[1:4]) for s in steps] * count


def requests(plan, leg):
    """What a leg is told, and when: centre-aligned pulses for a duty."""
    at, told = 0.0, []
    for duration, legs in commands(plan):
        word = legs[leg]
        if word in ("off", "low", "high"):
            told.append((at, word))
        else:
            on = float(word) * CARRIER
            for period in range(math.ceil(duration / CARRIER - 1e-9)):
                begin = at + period * CARRIER
                for time, gate in [(begin, "low"), (begin + (CARRIER - on) / 2, "high"), (begin + (CARRIER + on) / 2, "low")]:
                    if time < at + duration - 1e-12:
                        told.append((time, gate))
        at += duration
    return told, at


def gate_times(plan, leg, dead_time):
    """Intervals in which the upper and the lower switch are on: each switch-on waits for the dead time."""
    told, end = requests(plan, leg)
    changes = [told[0]]
    for time, word in told[1:]:
        if word != changes[-1][1]:
            changes.append((time, word))
    on = {"high": [], "low": []}
    for (time, word), following in zip(changes, [time for time, _ in changes[1:]] + [end]):
        if word in on and time + dead_time < following:
            on[word].append((time + dead_time, following))
    return on


def source(name, intervals, end):
    if not intervals:
        return f"V{name} {name} 0 0"
    points = [(0.0, 1.0 if intervals[0][0] <= 0.0 else 0.0)]
    for begin, stop in intervals:
        if begin > 0.0:
            points += [(begin - EDGE / 2, 0.0), (begin + EDGE / 2, 1.0)]
        if stop < end:
            points += [(stop - EDGE / 2, 1.0), (stop + EDGE / 2, 0.0)]
    words = [f"{time:.10g} {value:g}" for time, value in points]
    lines = [" ".join(words[k : k + 6]) for k in range(0, len(words), 6)]
    return f"V{name} {name} 0 PWL(" + "\n+ ".join(lines) + ")"


def netlist(case, longest):
    name, plan = case["name"], case["plan"]
    dead_time = float(case["dead_time_us"]) * 1e-6
    device = DEVICES[case["devices"]]
    end = sum(duration for duration, _ in commands(plan))
    lines = [
        f"* {name}: {plan}",
        f"* legs a b c; dead time {case['dead_time_us']} us; {case['devices']} devices; written by netlists.py.",
        "* Three coupled inductors by equations (1) and (2) of the paper at a rotor that stands still; 1 uH of leakage a phase",
        "* keeps them regular.",
        f".param la={case['l_a_mH']}m lb={case['l_b_mH']}m ls=1u angle={case['angle_deg']}",
        ".param third={2*3.141592653589793/3} two={2*angle*3.141592653589793/180}",
        ".param laa={la+ls+lb*cos(two)} lbb={la+ls+lb*cos(two-2*third)} lcc={la+ls+lb*cos(two+2*third)}",
        ".param mab={-la/2+lb*cos(two-third)} mbc={-la/2+lb*cos(two)} mca={-la/2+lb*cos(two+third)}",
        "L1 xa n {laa}",
        "L2 xb n {lbb}",
        "L3 xc n {lcc}",
        "K12 L1 L2 {mab/sqrt(laa*lbb)}",
        "K23 L2 L3 {mbc/sqrt(lbb*lcc)}",
        "K31 L3 L1 {mca/sqrt(lcc*laa)}",
        "Ra a xa 1",
        "Rb b xb 1",
        "Rc c xc 1",
        "Rn n 0 10meg",
        "Vdc p 0 550",
        f".model switch sw(ron={device['switch_resistance']} roff=10meg vt=0.5 vh=0)",
        ".model blocking d(is=1e-12 n=0.01)",
        f".model diode d(is=1e-12 n=0.01 rs={device['diode_resistance']})",
    ]
    for k, leg in enumerate("abc"):
        on = gate_times(plan, k, dead_time)
        lines += [
            f"* leg {leg}",
            f"Su{leg} p u{leg} gu{leg} 0 switch",
            f"Vsu{leg} u{leg} uu{leg} {device['switch_drop']}",
            f"Dbu{leg} uu{leg} {leg} blocking",
            f"Vfu{leg} {leg} d{leg} {device['diode_drop']}",
            f"Du{leg} d{leg} p diode",
            f"Sl{leg} {leg} l{leg} gl{leg} 0 switch",
            f"Vsl{leg} l{leg} ll{leg} {device['switch_drop']}",
            f"Dbl{leg} ll{leg} 0 blocking",
            f"Vfl{leg} e{leg} {leg} {device['diode_drop']}",
            f"Dl{leg} 0 e{leg} diode",
            source(f"gu{leg}", on["high"], end),
            source(f"gl{leg}", on["low"], end),
        ]
    lines += [
        ".options reltol=3e-5 abstol=1e-8 vntol=1e-4 method=gear",
        f".tran 20u {end:.10g} 0 {longest}u uic",
        ".control",
        "set wr_singlescale",
        "set wr_vecnames",
        "option numdgt=9",
        "run",
        "linearize",
        f"wrdata {name}.data i(L1) i(L2) i(L3)",
        ".endc",
        ".end",
    ]
    return "\n".join(lines) + "\n"


longest = sys.argv[1] if len(sys.argv) > 1 else "0.1"
with open(FOLDER / "cases.csv", newline="") as file:
    for case in csv.DictReader(file):
        (FOLDER / f"{case['name']}.cir").write_text(netlist(case, longest))
