"""Mean and Sobol' indices of the borehole function (openturns/otbenchmark, commit b2b6d0a, lists them to two digits) by scrambled Sobol'
nets: crates/analysis/tests/witness/sensitivity.rs.

    python borehole.py        needs numpy and scipy
"""
import numpy as np
from scipy.stats import norm, qmc

RANGES = [(63070, 115600), (990, 1110), (63.1, 116), (700, 820), (1120, 1680), (9855, 12045)]


def quantities(u):
    x = np.empty_like(u)
    x[:, 0] = 0.1 + 0.0161812 * norm.ppf(u[:, 0])
    x[:, 1] = np.exp(7.71 + 1.0056 * norm.ppf(u[:, 1]))
    for k, (low, high) in enumerate(RANGES, 2):
        x[:, k] = low + (high - low) * u[:, k]
    return x


def flow(x):
    rw, r, tu, hu, tl, hl, length, k = x.T
    ln = np.log(r / rw)
    return 2 * np.pi * tu * (hu - hl) / (ln * (1 + 2 * length * tu / (ln * rw**2 * k) + tu / tl))


results = []
for seed in range(8):
    u = np.clip(qmc.Sobol(16, seed=seed).random_base2(18), 1e-15, 1 - 1e-15)
    a, b = quantities(u[:, :8]), quantities(u[:, 8:])
    fa, fb = flow(a), flow(b)
    mean = (fa.mean() + fb.mean()) / 2
    variance = ((fa - mean) ** 2 + (fb - mean) ** 2).mean() / 2
    first, total = [], []
    for k in range(8):
        mixed = a.copy()
        mixed[:, k] = b[:, k]
        fm = flow(mixed)
        first.append(((fb - mean) * (fm - fa)).mean() / variance)
        total.append(((fa - fm) ** 2).mean() / 2 / variance)
    results.append([mean, variance, *first, *total])
results = np.array(results)
values, errors = results.mean(0), results.std(0, ddof=1) / np.sqrt(len(results))
print("mean", values[0], "±", errors[0], "variance", values[1])
for name, part in (("first", slice(2, 10)), ("total", slice(10, 18))):
    print(name, np.round(values[part], 5), "± at most", errors[part].max())
