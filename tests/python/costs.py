"""What Python costs, in processor time, each at its best of several turns: 20,000 trials of `bipolar` against the program's, at most
1.1 times; and a step of a detector in Python beyond the plant, at most 25 µs.

    python tests/python/costs.py path/to/standstill

The plant's part of a step is that of the same commands from a library in C. Ends with 77 where there is no C compiler.
"""

import pathlib
import resource
import shutil
import subprocess
import sys
import tempfile

import standstill as st

ROOT = pathlib.Path(__file__).resolve().parents[2]
TURNS = 8
SCENARIO = 'motor = "paper-5k5"\ndetector.method = "bipolar"\n'
COMMANDS = 400
TRIALS = 50

LIBRARY = """
#include <stddef.h>
#include "standstill.h"
static int left;
static void *create(const sts_drive *drive, const char *config, uint64_t seed, const char **refused)
{
    (void)drive, (void)config, (void)seed, (void)refused;
    return &left;
}
static int32_t step(void *detector, const sts_readings *readings, sts_command *command, sts_result *result)
{
    (void)detector, (void)readings, (void)result;
    if (++left >= COMMANDS)
        return STS_FAILED;
    command->stages = 1;
    command->stage[0].duration_ns = 100000;
    command->samples = 1;
    command->first_ns = 50000;
    return STS_GO_ON;
}
const sts_detector *sts_entry(uint32_t abi)
{
    static const sts_detector table = {.abi = STS_ABI, .size = sizeof table, .name = "idle", .create = create, .step = step};
    return abi == STS_ABI ? &table : NULL;
}
"""


class Idle:
    """Many short commands without current: the interpreter's share of a step."""

    def __init__(self):
        self.left = COMMANDS

    def step(self, readings):
        self.left -= 1
        if self.left:
            return st.Drive([st.Stage(("off", "off", "off"), 1e-4)], first=5e-5)
        return st.Failed("done")


def spent(who):
    usage = resource.getrusage(who)
    return usage.ru_utime + usage.ru_stime


def cost(work, who=resource.RUSAGE_SELF):
    begun = spent(who)
    work()
    return spent(who) - begun


def main():
    program = sys.argv[1]
    if not shutil.which("cc"):
        print("cc is not here: what a step costs was left out")
        sys.exit(77)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "s.toml").write_text(SCENARIO)
        (folder / "idle.c").write_text(LIBRARY)
        library = folder / "idle.so"
        of = ["-O2", "-shared", "-fPIC", f"-DCOMMANDS={COMMANDS}", "-I", ROOT / "crates/foreign/include"]
        subprocess.run(["cc", *of, "-o", library, folder / "idle.c"], check=True)
        trials = [program, "run", folder / "s.toml", "--trials", "20000", "--out", folder / "out", "--force"]
        works = {
            "program": lambda: subprocess.run(trials, check=True, capture_output=True),
            "python": lambda: st.run(SCENARIO, trials=20_000, progress=False),
            "steps in Python": lambda: st.run(f"trials = {TRIALS}", detector=Idle, threads=1, progress=False),
            "steps in C": lambda: st.run(f"trials = {TRIALS}", detector=library, threads=1, progress=False),
        }
        costs = {name: [] for name in works}
        for _ in range(TURNS):
            for name, work in works.items():
                who = resource.RUSAGE_CHILDREN if name == "program" else resource.RUSAGE_SELF
                costs[name].append(cost(work, who))
        best = {name: min(all_) for name, all_ in costs.items()}
        assert st.run(f"trials = {TRIALS}", detector=library, progress=False).summary["failed"] == TRIALS
    ratio = best["python"] / best["program"]
    step = (best["steps in Python"] - best["steps in C"]) / (TRIALS * COMMANDS)
    print(f"20,000 trials: {best['program']:.2f} s by the program, {best['python']:.2f} s from Python, {ratio:.2f} times")
    print(f"a step of a detector in Python: {step * 1e6:.1f} µs beyond the plant's")
    assert ratio <= 1.1, ratio
    assert step <= 25e-6, step


if __name__ == "__main__":
    main()
