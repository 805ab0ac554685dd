"""Subset sampling of OpenTURNS on the problems of openturns/otbenchmark (commit b2b6d0a), at as many calls as an answer of
`--effort quick` takes: how many of its own 95 % intervals hold the truth.

    pip install openturns git+https://github.com/openturns/otbenchmark@b2b6d0a
    python openturns_subset.py 30        answers each, seeds 1 to 30
"""
import math
import sys

import numpy as np
import openturns as ot
import otbenchmark as otb

ot.Log.Show(ot.Log.NONE)
# Name, probability (references.py), calls of an answer of ours.
PROBLEMS = """RP8 7.894e-4 48995
RP14 7.727e-4 48590
RP22 4.207306e-3 36800
RP24 2.859946e-3 36800
RP25 4.148566e-5 65510
RP28 1.453295e-7 96740
RP31 3.226681e-3 36800
RP33 2.575598e-3 36800
RP35 3.478946e-3 36800
RP38 8.051e-3 34955
RP53 3.132049e-2 22400
RP54 9.906031e-4 43865
RP55 5.600144e-1 8000
RP57 2.823751e-2 22400
RP60 4.48397e-2 22400
RP63 3.769436e-4 51200
RP75 9.819299e-3 30410
RP77 2.690844e-7 94535
RP89 5.471281e-3 36710
RP91 7.002537e-4 49490
RP107 2.866516e-7 94400
RP110 3.195788e-5 77570
RP111 8.035086e-7 91385
branches 2.222795e-3 36800
R-S 7.86496e-2 22265
beam 2.91982e-2 22400"""


def problem(name):
    others = {
        "branches": "FourBranchSerialSystemReliability",
        "R-S": "RminusSReliability",
        "beam": "AxialStressedBeamReliability",
    }
    return getattr(otb, others.get(name) or "ReliabilityProblem" + name[2:])()


answers = int(sys.argv[1]) if len(sys.argv) > 1 else 30
whole = 0
for line in PROBLEMS.split("\n"):
    name, truth, calls = line.split()
    truth, calls = float(truth), int(calls)
    states = max(1000, int(calls / max(1, math.ceil(-math.log10(truth)))) // 1000 * 1000)
    held, used, ratios = 0, 0, []
    for seed in range(1, answers + 1):
        ot.RandomGenerator.SetSeed(seed)
        algorithm = ot.SubsetSampling(problem(name).getEvent(), 2.0, 0.1)
        algorithm.setMaximumOuterSampling(states // 1000)
        algorithm.setBlockSize(1000)
        algorithm.run()
        result = algorithm.getResult()
        value, length = result.getProbabilityEstimate(), result.getConfidenceLength(0.95)
        held += value - length / 2 <= truth <= value + length / 2
        used += len(algorithm.getThresholdPerStep()) * states
        ratios.append(value / truth)
    whole += held
    rms = math.sqrt(np.mean((np.array(ratios) - 1) ** 2))
    print(f"{name:9} {truth:.3e} {held:3} of {answers}, {used / answers:7.0f} calls (ours {calls}), rms error {100 * rms:.1f} %, "
          f"{min(ratios):.2f} to {max(ratios):.2f}", flush=True)
print(f"all: {whole} of {answers * len(PROBLEMS.splitlines())}")
