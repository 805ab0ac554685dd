"""Random motors on random drives with ringing terminals: does any start end in the simulator instead of in the detector?

    tests/python/random_motors.py STANDSTILL SECONDS [SEED]

Each number draws a motor by its nameplate (10 to 650 V, 0.5 to 200 A, rated current within 5 us to 2.5 ms, saliency 3 to 150 %,
saturation 0.5 to 25 %), IGBTs or MOSFETs, 0.1 to 10 nF at each terminal, a rotor that is locked or free and a method, and runs 30 or 100
starts with error set `field`. Prints each run with an end such as "conduction modes keep changing" with its command and data sheet, and the
counts; code 1 if there was one.
"""

import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SLOW = ["hfi-rotating", "hfi-pulsating", "line-inductance"]
METHODS = [
    *SLOW,
    "line-inductance-fast", "subdivision", "bipolar", "maximum-likelihood", "maximum-likelihood-adaptive",
]
ENDS_OF_THE_SIMULATOR = ["keep changing without time", "left the finite numbers", "no step can be taken from there", "panicked"]


def nameplate(draw: random.Random) -> str:
    link = draw.choice([12, 24, 36, 48, 60, 96, 300, 560]) * draw.uniform(0.85, 1.15)
    current = 10 ** draw.uniform(-0.3, 2.3)
    inductance = link * 10 ** draw.uniform(-5.3, -2.6) / current
    resistance = 10 ** draw.uniform(-3, -0.5) * link / current
    flux = draw.uniform(1, 8) * inductance * current
    return f"""[nameplate]
pole_pairs = {draw.choice([2, 3, 4, 5, 7, 11, 15])}
resistance = "{resistance:.4g} ohm"
L_d = "{inductance * 1e6:.5g} uH"
L_q = "{inductance * draw.uniform(1.03, 2.5) * 1e6:.5g} uH"
magnet_flux = "{flux * 1e3:.4g} mWb"
rated_current = "{current:.4g} A"
dc_link = "{link:.4g} V"
saturation = "{draw.uniform(0.5, 25):.3g} %"
"""


def main() -> int:
    program, seconds = str(Path(sys.argv[1]).resolve()), float(sys.argv[2])
    number = int(sys.argv[3]) if len(sys.argv) > 3 else 0
    end, runs, starts, bad, refused, late = time.time() + seconds, 0, 0, 0, 0, 0
    while time.time() < end:
        draw = random.Random(number)
        sheet = nameplate(draw)
        method = draw.choice(METHODS)
        trials = 30 if method in SLOW else 100
        keys = {
            "detector.method": method,
            "errors": "field",
            "rotor.state": draw.choice(["free", "locked"]),
            "inverter.devices": draw.choice(["igbt", "mosfet"]),
            "inverter.terminal_capacitance": draw.choice(["0.1 nF", "0.3 nF", "1 nF", "3 nF", "10 nF"]),
        }
        command = ["run", "motor.toml", "--trials", str(trials), "--seed", str(number), "--threads", "1", "--out", "out"]
        command += [word for key, value in keys.items() for word in ("-s", f"{key}={value}")]
        number += 1
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "motor.toml").write_text(sheet)
            try:
                done = subprocess.run([program, *command], cwd=folder, capture_output=True, text=True, timeout=90)
            except subprocess.TimeoutExpired:
                late += 1
                continue
            table = Path(folder) / "out" / "trials.csv"
            said = done.stdout + done.stderr + (table.read_text() if table.exists() else "")
        ends = [words for words in ENDS_OF_THE_SIMULATOR if words in said]
        if done.returncode == 2 and not ends:
            refused += 1
            continue
        runs, starts = runs + 1, starts + trials
        if ends:
            bad += 1
            print(f"{', '.join(ends)}: standstill {' '.join(command)}\n{sheet}", flush=True)
    print(f"{runs} motors, {starts} starts, {bad} with such an end; {refused} refused, {late} longer than 90 s")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
