"""Two pulses across the phases of a drive, by FMPy: what its converters see of them.

    python fmu_pulse.py drive.fmu
"""

import sys

import fmpy
import numpy as np

OFF, LOW, HIGH = 0, 1, 2


def main(path: str) -> None:
    period = float(fmpy.read_model_description(path).defaultExperiment.stepSize)
    # A pulse from a to b, then all off, then one from b to a: one row from each time on.
    steps = [(OFF, OFF, OFF), (HIGH, LOW, OFF), *[(OFF, OFF, OFF)] * 8, (LOW, HIGH, OFF), *[(OFF, OFF, OFF)] * 8]
    rows = [(n * period, *modes, 0.0, 0.0, 0.0) for n, modes in enumerate(steps)]
    inputs = [("time", float), *((f"mode_{leg}", int) for leg in "abc"), *((f"duty_{leg}", float) for leg in "abc")]
    legs = np.array(rows, dtype=inputs)
    result = fmpy.simulate_fmu(
        path,
        stop_time=len(steps) * period,
        output_interval=period,
        input=legs,
        start_values={"seed": 5, "rotor.draw_angle": False, "rotor.angle": np.radians(30.0)},
        output=["sampled.i_a", "count.i_a", "actual.i_a", "actual.angle"],
    )
    print("      t/µs  sampled i_a/A   code   true i_a/A")
    for row in result:
        print(f"{row['time'] * 1e6:10.1f} {row['sampled.i_a']:14.4f} {row['count.i_a']:6d} {row['actual.i_a']:12.4f}")
    assert abs(result["actual.i_a"]).max() > 0.1, "no current flowed"


if __name__ == "__main__":
    main(sys.argv[1])
