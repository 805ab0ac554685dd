"""Probabilities of the reliability problems that crates/odds/tests/systems/reliability.rs takes from openturns/otbenchmark
(commit b2b6d0a), by quadrature: one variable is integrated in closed form, the others numerically.

    python references.py        needs numpy and scipy

Each line has the name, the probability, and an estimate of its relative error (0: closed form). Problems of four and six
remaining variables are integrated over 16 scrambled Sobol' nets; their error is the standard error over the nets.
"""
import numpy as np
from scipy import integrate, optimize, stats
from scipy.stats import norm, qmc


def line(f, breaks=(), low=-9.0, high=9.0):
    """Integral of f(z) over a standard normal z, piecewise between breaks."""
    ends = [low, *sorted(b for b in breaks if low < b < high), high]
    # Pieces of at most a half, so that no peak is passed over.
    total = 0.0
    for a, b in zip(ends, ends[1:]):
        cuts = np.linspace(a, b, int(np.ceil((b - a) / 0.5)) + 1)
        for x, y in zip(cuts, cuts[1:]):
            total += integrate.quad(lambda z: f(z) * norm.pdf(z), x, y, epsabs=0.0, epsrel=1e-12, limit=200)[0]
    return total


def between(a, b):
    """P(a < z < b), exact in the tails too."""
    if a > 0:
        return norm.sf(a) - norm.sf(b)
    return norm.cdf(b) - norm.cdf(a)


def lognormal(mean, deviation):
    s = np.log(1 + (deviation / mean) ** 2)
    return np.log(mean) - s / 2, np.sqrt(s)


def nets(f, dimension, power=20, count=16):
    """Mean of f over standard normals by scrambled Sobol' nets, with its relative standard error."""
    means = []
    for seed in range(count):
        u = qmc.Sobol(dimension, seed=seed).random_base2(power)
        means.append(np.mean(f(norm.ppf(np.clip(u, 1e-16, 1 - 1e-16)))))
    return np.mean(means), np.std(means, ddof=1) / np.sqrt(count) / np.mean(means)


def rp8():
    parts = [lognormal(m, s) for m, s in [(120, 12), (120, 12), (120, 12), (120, 12), (50, 10), (40, 8)]]

    # The last variable in closed form: x6 > (x1 + 2 x2 + 2 x3 + x4 − 5 x5)/5.
    def tail(z):
        x = [np.exp(m + s * z[:, k]) for k, (m, s) in enumerate(parts[:5])]
        rest = (x[0] + 2 * x[1] + 2 * x[2] + x[3] - 5 * x[4]) / 5
        m, s = parts[5]
        return np.where(rest > 0, norm.sf((np.log(np.maximum(rest, 1e-300)) - m) / s), 1.0)

    return nets(tail, 5)


def rp14():
    def tail(z):
        gumbel_scale = 350 * np.sqrt(6) / np.pi
        x3 = 1500 - np.euler_gamma * gumbel_scale - gumbel_scale * np.log(-norm.logcdf(z[:, 1]))
        x2, x4, x5 = 39 + 0.1 * z[:, 0], 400 + 0.1 * z[:, 2], 250_000 + 35_000 * z[:, 3]
        load = 32 / (np.pi * x2**3) * np.sqrt(x3**2 * x4**2 / 16 + x5**2)
        return np.clip((load - 70) / 10, 0, 1)

    return nets(tail, 4)


def rp38():
    of = [(50.8, 5.08), (3.81, 0.381), (173, 17.3), (9.38, 0.938), (33.1, 3.31), (0.036, 0.0036)]

    def tail(z):
        x2, x3, x4, x5, x6, x7 = (m + s * z[:, k] for k, (m, s) in enumerate(of))
        each = x2**3 / (2 * x3**3) * (x4**2 - 4 * x5 * x6 * x7**2 + x4 * (x6 + 4 * x5 + 2 * x6 * x7))
        each /= x4 * x5 * (x4 + x6 + 2 * x6 * x7)
        return norm.sf((155_900 / each - 350) / 35)

    return nets(tail, 6)


def rp91():
    # As the check of this function in the project's older table: x1 and x3 to x5 matter, x1 in closed form where g2 or g3 fail.
    def tail(z):
        b, c, d, e = 0.1 + 0.01 * z[:, 0], 13 + 60 * z[:, 1], 4751 + 48 * z[:, 2], -684 + 11 * z[:, 3]
        first = 0.847 + 0.96 * b + 0.986 * c - 0.216 * d + 0.077 * b**2 + 0.11 * c**2 + 7 / 378 * d**2
        first += -c * b - 0.106 * b * d - 0.11 * c * d
        need = np.maximum(np.sqrt(c**2 + d**2 - c * d + 3 * e**2), np.abs(d)) / 84_000
        return np.where(first < 0, 1.0, norm.cdf((need - 0.07433) / 0.005))

    return nets(tail, 4)


def rp60():
    parts = [lognormal(m, s) for m, s in [(2200, 220), (2100, 210), (2300, 230), (2000, 200), (1200, 480)]]

    def fails(z):
        load = np.exp(parts[4][0] + parts[4][1] * z)
        # Whether element k is stronger than its limit, all independent given the load.
        cdf = lambda k, limit: norm.cdf((np.log(limit) - parts[k][0]) / parts[k][1])
        weak = [cdf(k, load) for k in range(4)]
        half = [cdf(k, load / 2) for k in range(4)]
        # min(g1, max(min(g2, g3, g4), max(g7, min(g5, g6)))) < 0: x1 < load, or the rest fails, which is: x4 < load, and x2 or x3 < load,
        # and one of x2, x3, x4 below half. Sum over each of x2, x3, x4 being below half, between, or above.
        rest = 0.0
        for s2 in range(3):
            for s3 in range(3):
                for s4 in range(3):
                    p = 1.0
                    for k, s in ((1, s2), (2, s3), (3, s4)):
                        p *= (half[k], weak[k] - half[k], 1 - weak[k])[s]
                    if s4 < 2 and (s2 < 2 or s3 < 2) and 0 in (s2, s3, s4):
                        rest += p
        return 1 - (1 - weak[0]) * (1 - rest)

    return line(fails, np.linspace(-4, 4, 9)), 1e-10


def rp24():
    # d = x1 − x2 and s = x1 + x2 − 20, both of standard deviation 3 √2 and independent.
    r = 3 * np.sqrt(2)
    return line(lambda z: norm.sf((2.5 + 0.00463 * (r * z) ** 4) / 0.2357 / r)), 1e-10


def rp25():
    # x2 > (x1² + 16)/8 and x2 < 16 x1 − 32.
    root = (128 - np.sqrt(128**2 - 4 * 272)) / 2
    return line(lambda x: max(0.0, between((x * x + 16) / 8, 16 * x - 32)), [root]), 1e-10


def rp28():
    # x1 is never below zero within 6.6 deviations; both signs of x1 are taken.
    def inner(z):
        x = 78_064 + 11_710 * z
        limit = (146.14 / x - 0.0104) / 0.00156
        return norm.cdf(limit) if x > 0 else norm.sf(limit)

    return line(inner, [-78_064 / 11_710]), 1e-10


def rp33():
    # z3 > 3, or z3 < 3 and z1 + z2 > 3 √3 − z3.
    return norm.sf(3) + line(lambda z: norm.sf((3 * np.sqrt(3) - z) / np.sqrt(2)), high=3.0), 1e-10


def rp35():
    def inner(x):
        first = norm.sf(2 + np.exp(-0.1 * x * x) + (0.2 * x) ** 4)
        if x == 0:
            return first
        limit = 2 + np.exp(-0.1 * x * x) + (0.2 * x) ** 4
        return norm.sf(min(limit, 4.5 / x)) if x > 0 else first + norm.cdf(4.5 / x)

    f = lambda x: 2 + np.exp(-0.1 * x * x) + (0.2 * x) ** 4 - 4.5 / x
    grid = np.linspace(0.05, 9, 400)
    roots = [optimize.brentq(f, a, b) for a, b in zip(grid, grid[1:]) if f(a) * f(b) < 0]
    return line(inner, [0.0, *roots]), 1e-10


def rp53():
    return line(lambda z: norm.sf(1 + 20 * (np.sin(2.5 * (1.5 + z)) + 2) / ((1.5 + z) ** 2 + 4) - 2.5)), 1e-10


def rp57():
    def inner(x):
        # max(g1, g2) < 0: x2 < cbrt(x1² − 3) and x2 > (2 − x1)/8; or within the circle of g3.
        parts = []
        a, b = (2 - x) / 8, np.cbrt(x * x - 3)
        if a < b:
            parts.append((a, b))
        if abs(x + 3) < 2:
            half = np.sqrt(4 - (x + 3) ** 2)
            parts.append((-3 - half, -3 + half))
        parts.sort()
        total, end = 0.0, -np.inf
        for a, b in parts:
            a = max(a, end)
            if b > a:
                total += between(a, b)
                end = b
        return total

    f = lambda x: np.cbrt(x * x - 3) - (2 - x) / 8
    grid = np.linspace(-9, 9, 2001)
    roots = [optimize.brentq(f, a, b) for a, b in zip(grid, grid[1:]) if f(a) * f(b) < 0]
    return line(inner, [-5, -3, -1, -np.sqrt(3), np.sqrt(3), *roots]), 1e-8


def rp55():
    # d = x1 − x2 has a triangular density on −2 to 2, and all is even in d.
    roots = optimize.brentq(lambda d: 0.2 + 0.6 * d**4 - d / np.sqrt(2), 0, 0.5), optimize.brentq(
        lambda d: 0.2 + 0.6 * d**4 - d / np.sqrt(2), 0.5, 2
    )
    edge = 5 / np.sqrt(2) - 2.2
    mass = lambda a, b: 2 * ((2 - a) ** 2 - (2 - b) ** 2) / 8
    return mass(*roots) + mass(edge, 2), 1e-12


def rp75():
    return 2 * line(lambda x: norm.sf(3 / x) if x > 0 else 0.0, [0.0], low=0.0), 1e-10


def rp77():
    # x3 ≤ 5: x1 − x2 < x3 with x1 − x2 of mean 10 and variance 1.25; above: x2 > x3.
    return line(lambda z: norm.cdf((4 + z - 10) / np.sqrt(1.25)), high=1.0) + line(
        lambda z: norm.sf(4 + z), low=1.0
    ), 1e-10


def rp89():
    return line(lambda x: norm.sf(min(8 - x * x, 6 - x / 5)), [
        (1 / 5 - np.sqrt(1 / 25 + 8)) / 2, (1 / 5 + np.sqrt(1 / 25 + 8)) / 2]), 1e-10


def rp110():
    # Either branch can fail beyond its step alone: x1 > 4, x2 > 5.
    return 1 - (1 - norm.sf(4)) * (1 - norm.sf(5)), 0


def rp111():
    return 4 * line(lambda x: norm.sf(12.5 / x) if x > 0 else 0.0, [0.0], low=0.0), 1e-10


def four_branches():
    # s and d along the diagonals, independent standard normals: |s| > 3 + 0.2 d², or |d| > 3.5.
    return 2 * norm.sf(3.5) + line(lambda d: 2 * norm.sf(3 + 0.2 * d * d), low=-3.5, high=3.5), 1e-10


def beam():
    m, s = lognormal(300, 30)
    return line(lambda z: norm.sf((np.exp(m + s * z) * 100 * np.pi - 75_000) / 5000)), 1e-10


ALL = {
    "RP8": rp8,
    "RP14": rp14,
    "RP22": lambda: (line(lambda d: norm.sf(2.5 + 0.2 * d * d)), 1e-10),
    "RP24": rp24,
    "RP25": rp25,
    "RP28": rp28,
    "RP31": lambda: (line(lambda x: norm.sf(2 + 256 * x**4)), 1e-10),
    "RP33": rp33,
    "RP35": rp35,
    "RP38": rp38,
    "RP53": rp53,
    "RP54": lambda: (stats.gamma(20).cdf(8.951), 0),
    "RP55": rp55,
    "RP57": rp57,
    "RP60": rp60,
    "RP63": lambda: (
        integrate.quad(lambda q: stats.chi2(99).pdf(q) * norm.sf(0.1 * q - 4.5), 20, 200, epsrel=1e-12, epsabs=0, limit=500)[0],
        1e-10,
    ),
    "RP75": rp75,
    "RP77": rp77,
    "RP89": rp89,
    "RP91": rp91,
    "RP107": lambda: (norm.sf(5), 0),
    "RP110": rp110,
    "RP111": rp111,
    "four branches": four_branches,
    "R-S": lambda: (norm.cdf(-2 / np.sqrt(2)), 0),
    "beam": beam,
}

if __name__ == "__main__":
    for name, of in ALL.items():
        probability, error = of()
        print(f"{name:14} {probability:.7e} {error:.0e}", flush=True)
