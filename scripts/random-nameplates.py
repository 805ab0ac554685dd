#!/usr/bin/env python3
"""Starts of random, sound motors: how often each method names a wrong pole, an axis far off, or refuses.

    python3 scripts/random-nameplates.py PROGRAM FIRST LAST [METHODS [ERRORS [KEY=VALUE ...]]]

PROGRAM: the path of `standstill`. The motors of the seeds FIRST to LAST - 1 are drawn (log-uniform: winding and load of drives of 12 to
560 V). METHODS and ERRORS: names separated by commas. Prints a line for each run with a wrong pole or an axis more than 25 degrees off,
with the motor's file, then the sums of all runs. 60 starts each; the trials are those of seed 1.
"""
import collections, csv, json, math, os, random, subprocess, sys, tempfile

METHODS = ("line-inductance,line-inductance-fast,subdivision,hfi-rotating,hfi-pulsating,bipolar,maximum-likelihood,"
           "maximum-likelihood-adaptive,six-pulse")


def motor(seed):
    """The lines of a nameplate."""
    draw = random.Random(seed)
    log = lambda low, high: math.exp(draw.uniform(math.log(low), math.log(high)))
    link = draw.choice([12, 24, 36, 48, 96, 310, 560])
    power = log(20, 400) * (link / 24 if link < 100 else link / 60)
    current = power / link * 1.3 * draw.uniform(0.8, 1.3)
    pairs = draw.choice([2, 3, 4, 5, 7, 10, 14, 20])
    resistance = log(0.02, 0.14) * link / (2 * current)
    flux = 0.45 * link / (2 * math.pi * log(60, 900))
    along = log(0.06, 0.5) * flux / current
    across = along * (1 + log(0.03, 1.2))
    saturation = log(0.04, 0.2)
    return {"pole_pairs": pairs, "resistance": f"{resistance:.4g} Ohm", "L_d": f"{along:.4g} H", "L_q": f"{across:.4g} H",
            "magnet_flux": f"{flux:.4g} Wb", "rated_current": f"{current:.3g} A", "dc_link": f"{link} V",
            "saturation": f"{100 * saturation:.2g} %"}


def main():
    program, first, last = os.path.abspath(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    methods = (sys.argv[4] if len(sys.argv) > 4 else METHODS).split(",")
    errors = (sys.argv[5] if len(sys.argv) > 5 else "default,harsh").split(",")
    keys = [word for key in sys.argv[6:] for word in ("-s", key)]
    sums = collections.defaultdict(collections.Counter)
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(first, last):
            lines = "".join(f"{key} = {json.dumps(value)}\n" for key, value in motor(seed).items())
            with open(f"{folder}/m.toml", "w") as sheet:
                sheet.write("[nameplate]\n" + lines)
            for error in errors:
                for method in methods:
                    of = sums[method, error]
                    run = subprocess.run([program, "run", "m.toml", "--trials", "60", "-s", f"detector.method={method}", "-s",
                                          f"errors={error}", *keys, "--json", "--out", "out", "--force"],
                                         cwd=folder, capture_output=True, text=True)
                    if run.returncode:
                        of["not run"] += 60
                        print(f"seed {seed}, {method}, {error}: {run.stderr.strip().splitlines()[-1]}", flush=True)
                        continue
                    summary = json.loads(run.stdout)["summary"]
                    with open(f"{folder}/out/trials.csv") as table:
                        far = sum(row["outcome"] == "found" and abs((float(row["error_deg"]) + 90) % 180 - 90) > 25
                                  for row in csv.DictReader(table))
                    found = {"named": summary["found"], "wrong": summary["wrong_poles"], "far": far,
                             "open": summary["undetermined"], "failed": summary["failed"] + summary["errors"]}
                    of.update(found)
                    if found["wrong"] or far:
                        print(f"seed {seed}, {method}, {error}: {found}\n{lines}", flush=True)
    for (method, error), of in sorted(sums.items()):
        print(method, error, ", ".join(f"{name} {of[name]}" for name in ("named", "wrong", "far", "open", "failed", "not run")))


main()
