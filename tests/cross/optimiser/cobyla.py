"""Constrained problems by PRIMA's COBYLA, as SciPy 1.16 or later has it, in the stages of `tune`: beside
crates/analysis/tests/witness/optimiser.rs, which has the same problems, starts and numbers of looks.

    python cobyla.py        needs numpy and scipy >= 1.16
"""
import numpy as np
from scipy.optimize import minimize

PI = np.pi


def camel(v):
    x, y = v
    return 4 * x**2 - 2.1 * x**4 + x**6 / 3 + x * y - 4 * y**2 + 4 * y**4 + 2


def beam_limits(x):
    h, l, t, b = x
    s = l * l / 4 + (h + t) ** 2 / 4
    moment = 6000 * (14 + l / 2)
    direct = 6000 / (np.sqrt(2) * h * l)
    bent = moment * np.sqrt(s) / (2 * np.sqrt(2) * h * l * (l * l / 12 + (h + t) ** 2 / 4))
    shear = np.sqrt(direct**2 + direct * bent * l / np.sqrt(s) + bent**2)
    buckling = 4.013 * 30e6 * np.sqrt(t * t * b**6 / 36) / 196 * (1 - t / 28 * np.sqrt(30e6 / (4 * 12e6)))
    return [shear / 13600 - 1, 504000 / (b * t * t) / 30000 - 1, h / b - 1, 1 - buckling / 6000]


def vessel(x):
    s, h, r, l = x[0] / 16, x[1] / 16, x[2], x[3]
    return 0.6224 * s * r * l + 1.7781 * h * r**2 + 3.1661 * s**2 * l + 19.84 * s**2 * r


def vessel_limits(x):
    s, h, r, l = x[0] / 16, x[1] / 16, x[2], x[3]
    return [0.0193 * r / s - 1, 0.00954 * r / h - 1, 1 - PI * r * r * (l + 4 / 3 * r) / 1296000]


def spring_limits(x):
    d, w, n = x
    return [
        1 - w**3 * n / (71785 * d**4),
        (4 * w * w - d * w) / (12566 * (w * d**3 - d**4)) + 1 / (5108 * d * d) - 1,
        1 - 140.45 * d / (w * w * n),
        (w + d) / 1.5 - 1,
    ]


PROBLEMS = [
    (
        "G24",
        [(0, 3), (0, 4)],
        (),
        lambda x: 10 - x[0] - x[1],
        lambda x: [
            (-2 * x[0] ** 4 + 8 * x[0] ** 3 - 8 * x[0] ** 2 + x[1] - 2) / 2,
            (-4 * x[0] ** 4 + 32 * x[0] ** 3 - 88 * x[0] ** 2 + 96 * x[0] + x[1] - 36) / 36,
        ],
        4.491987,
    ),
    (
        "Gomez-Levy",
        [(-1, 0.75), (-1, 1)],
        (),
        camel,
        lambda v: [(-np.sin(4 * PI * v[0]) + 2 * np.sin(2 * PI * v[1]) ** 2) / 1.5 - 1],
        0.968372,
    ),
    ("spring", [(0.05, 2), (0.25, 1.3), (2, 15)], (), lambda x: (x[2] + 2) * x[1] * x[0] ** 2, spring_limits, 0.0126652),
    (
        "welded beam",
        [(0.1, 2), (0.1, 10), (0.1, 10), (0.1, 2)],
        (),
        lambda x: 1.10471 * x[0] ** 2 * x[1] + 0.04811 * x[2] * x[3] * (14 + x[1]),
        beam_limits,
        1.724852,
    ),
    ("pressure vessel", [(1, 32), (1, 32), (10, 200), (10, 200)], (0, 1), vessel, vessel_limits, 6059.714),
]


def sought(ranges, whole, f, limits, noise, seed):
    draws = np.random.default_rng(seed)
    looks = []

    def values(places):
        out = []
        for k, ((low, high), place) in enumerate(zip(ranges, np.clip(places, 0, 1))):
            x = low * np.exp(place * np.log(high / low)) if low > 0 else low + place * (high - low)
            out.append(round(x) if k in whole else x)
        return np.array(out, float)

    def look(places, trials):
        x = values(places)
        sigma = noise / np.sqrt(trials)
        merit = np.log(f(x)) + sigma * draws.normal()
        left = np.array([-g + sigma * draws.normal() for g in limits(x)])
        left = np.where(left < -1, np.maximum(-1 - np.log(np.maximum(-left, 1)), -10), left)
        looks.append((trials, max(0, -left.min()) and -np.minimum(left, 0).sum(), merit, np.array(places), x))
        return merit, left

    def descent(start, trials, width, often):
        n, began = len(ranges), len(looks)
        known = {}

        def at(places):
            key = tuple(places)
            if key not in known:
                known[key] = look(places, trials)
            return known[key]

        minimize(
            lambda p: at(p)[0],
            start,
            method="COBYLA",
            bounds=[(0, 1)] * n,
            constraints=[{"type": "ineq", "fun": lambda p: at(p)[1]}],
            options={"rhobeg": width, "tol": 0.02 * width, "maxiter": often * n + 3},
        )
        return min(looks[began:], key=lambda look: look[1:3])

    roots = np.sqrt([2, 3, 5, 7])
    ends = [descent((0.5 + start * roots[: len(ranges)]) % 1, 1, 0.25, 16) for start in range(6)]
    ends.sort(key=lambda look: look[1:3])
    for end in ends[:3]:
        descent(end[3], 9, 0.06, 10)
    best = min((look for look in looks if look[0] == 9), key=lambda look: look[1:3])
    return best[4], len(looks)


for name, ranges, whole, f, limits, best in PROBLEMS:
    for noise in (0.0, 0.02):
        found = [sought(ranges, whole, f, limits, noise, seed) for seed in range(1, 6 if noise else 2)]
        regrets = sorted(f(x) / best - 1 for x, _ in found)
        broken = max(max(0, *limits(x)) for x, _ in found)
        looks = np.mean([count for _, count in found])
        print(f"{name}, noise {noise}: regret {regrets[len(regrets) // 2]:.4f} of {np.round(regrets, 4)}, broken {broken:.4f}, {looks:.0f} looks")
