"""Writes joint_field.json: kernels, sizes by evidence and by sampling, and left-out parts of a small field of joint errors.

    python tests/data/golden/joint_field.py >joint_field.json

Three joints, 14 samples of three rows, all from closed formulas. Kernels are computed by their formulas, parts left out by
fitting without them, and the posterior of the sizes by a Metropolis sampler with the coefficients integrated out.
"""

import json
import sys

import numpy as np

JOINTS, SAMPLES = 3, 14
ROWS = 3 * SAMPLES
UNIT = 50e-6
BANDS = [(1, 4), (5, 10), (11, 20), (21, 40), (41, 80)]
STATED, NU = 10.0, 2.0
TAILS = np.array([2.5, 4.0, 7.0, 15.0, 50.0])
GRID = np.exp(np.linspace(np.log(0.01), np.log(3.0), 48))
SWEEPS, DROPPED = int(sys.argv[1]) if len(sys.argv) > 1 else 6000, 2000

s, j, r = np.arange(SAMPLES), np.arange(JOINTS), np.arange(ROWS)
q = 1.2 * np.sin(0.7 + 1.3 * s[:, None] + 2.1 * j + 0.37 * s[:, None] * j)
tau = 10.0 * j * np.cos(0.4 + 0.9 * s[:, None] + 1.7 * j)
lever = 6e4 * np.sin(1 + 0.5 * r[:, None] + 0.8 * j)
smooth = np.stack([3 * np.cos(0.3 * r * (k + 1) + k) for k in range(2)], 1)
effects = np.stack([1.5 * np.sin(0.45 * r * (k + 1) + 2 * k) for k in range(2)], 1)
of = r // 3
y = (
    2 * smooth[:, 0]
    - smooth[:, 1]
    + 1.2e-4 * lever[:, 0] * np.sin(2 * q[of, 0] + 0.3) * np.sin(2 * q[of, 1])
    + 6e-5 * lever[:, 1] * np.cos(q[of, 1])
    + 1.1 * np.sin(0.31 * r * r + 0.2)
)

weights = np.array([np.mean([l * np.exp(-0.5 * (l * h) ** 2) for l in (0.5, 0.9, 1.5)]) for h in range(1, 5)])
weights /= weights.sum()


def difference(angle):
    return angle[:, None] - angle[None]


def smooth_kernel(angle):
    return sum(w * np.cos((h + 1) * difference(angle)) for h, w in enumerate(weights))


kernels, kinds = [effects @ effects.T], [0]
for joint in range(JOINTS):
    own = np.outer(lever[:, joint], lever[:, joint]) * UNIT**2

    def add(kernel, kind):
        kernels.append(own * kernel[np.ix_(of, of)])
        kinds.append(kind)

    for first, last in BANDS:
        add(np.mean([np.cos(h * difference(q[:, joint])) for h in range(first, last + 1)], 0), 1 if last <= 20 else 2)
    add(smooth_kernel(q[:, 0]) * smooth_kernel(q[:, 1]), 3)
    if joint > 0:
        x = np.clip(tau[:, joint] / np.sqrt(np.mean(tau[:, joint] ** 2)), -4, 4)
        load = np.outer(x, x) + 0.3 * np.outer(x * x - 1, x * x - 1)
        for angle in (0, 1):
            add(load * (0.15 + smooth_kernel(q[:, angle])), 4)
kernels, kinds = np.array(kernels), np.array(kinds)
groups = len(kernels)
base = smooth @ smooth.T


def covariance(sizes):
    return base + np.tensordot(sizes, kernels, 1)


plain = covariance(0.01 * (1 + np.arange(groups)))

# Sizes by evidence.
v = np.array([0.3, 1.0, 1.0, 0.1, 0.1])[kinds]
noise = max(1.0, 0.3 * np.mean(y * y))
for _ in range(14):
    c = np.linalg.inv(covariance(v) + noise * np.eye(ROWS))
    a = c @ y
    new = v.copy()
    for kind in range(5):
        own = np.where(kinds == kind)[0]
        common = min(np.exp(np.mean(np.log(v[own]))), 1.0)
        for g in own:
            new[g] = (v[g] ** 2 * (a @ kernels[g] @ a) + 4 * common) / (v[g] * np.sum(c * kernels[g]) + 4)
    v = np.clip(new, 1e-6, 4.0)
    noise = (noise**2 * (a @ a) + STATED) / (noise * np.trace(c) + STATED)
field = covariance(v) @ np.linalg.solve(covariance(v) + noise * np.eye(ROWS), y)

# The model alone.
alone = max(1.0, 0.0)
for _ in range(8):
    c = np.linalg.inv(base + alone * np.eye(ROWS))
    a = c @ y
    alone = (alone**2 * (a @ a) + STATED) / (alone * np.trace(c) + STATED)

# Parts left out, by fitting without them.
left_out = []
for part in ([0, 5, 9], [2, 3, 4, 12]):
    rows = np.concatenate([3 * k + np.arange(3) for k in part])
    rest = np.setdiff1d(r, rows)
    m = covariance(v) + noise * np.eye(ROWS)
    across = np.linalg.solve(m[np.ix_(rest, rest)], m[np.ix_(rest, rows)])
    left_out.append(
        {
            "samples": part,
            "errors": list(y[rows] - across.T @ y[rest]),
            "variances": list(np.diag(m[np.ix_(rows, rows)] - m[np.ix_(rows, rest)] @ across)),
        }
    )

# The posterior of the sizes: coefficients integrated out, Student's noise by its weights.
from math import lgamma  # noqa: E402

random = np.random.default_rng(7)
v_, t, s2, w, tail = np.full(groups, 0.01), np.full(5, 0.1), 1.0, np.ones(SAMPLES), 15.0
count = np.bincount(kinds, minlength=5)


def log_marginal(k, nz):
    l = np.linalg.cholesky(k + np.diag(nz))
    z = np.linalg.solve(l, y)
    return -0.5 * z @ z - np.log(np.diag(l)).sum()


sums, squares, moved, kept, noises = np.zeros(groups), np.zeros(groups), np.zeros(ROWS), 0, 0.0
for sweep in range(SWEEPS):
    nz = s2 / w[of]
    k = covariance(v_)
    now = log_marginal(k, nz)
    for g in range(groups):
        prior = lambda log: -0.5 * NU * (log + t[kinds[g]] ** 2 / np.exp(log))
        old = np.log(v_[g])
        other = old + random.normal() * (1.0 if random.random() < 0.5 else 3.0)
        k2 = k + (np.exp(other) - v_[g]) * kernels[g]
        then = log_marginal(k2, nz)
        if np.log(random.random()) < then + prior(other) - now - prior(old):
            v_[g], k, now = np.exp(other), k2, then
    for kind in range(5):
        own = kinds == kind
        log = NU * count[kind] * np.log(GRID) - 0.5 * NU * GRID**2 * (1 / v_[own]).sum()
        p = np.exp(log - log.max())
        t[kind] = random.choice(GRID, p=p / p.sum())
        place = np.argmin(abs(GRID - t[kind])) + int(random.integers(-8, 9))
        if 0 <= place < len(GRID):
            factor = (GRID[place] / t[kind]) ** 2
            other = v_ * np.where(own, factor, 1)
            k2 = covariance(other)
            then = log_marginal(k2, nz)
            # With v / t^2 fixed the prior is that of t, which is uniform in its logarithm.
            if np.log(random.random()) < then - now:
                v_, k, now, t[kind] = other, k2, then, GRID[place]
    m = k + np.diag(nz)
    root = np.linalg.cholesky(k + 1e-9 * np.eye(ROWS))
    f = root @ random.normal(size=ROWS)
    f = f + k @ np.linalg.solve(m, y - f - np.sqrt(nz) * random.normal(size=ROWS))
    d2 = ((y - f) ** 2).reshape(SAMPLES, 3).sum(1)
    w = random.chisquare(tail + 3, SAMPLES) / (tail + d2 / s2)
    s2 = ((w * d2).sum() + STATED) / random.chisquare(ROWS + STATED)
    log = np.array(
        [SAMPLES * (h / 2 * np.log(h / 2) - lgamma(h / 2)) + h / 2 * (np.log(w).sum() - w.sum()) for h in TAILS]
    )
    p = np.exp(log - log.max())
    tail = random.choice(TAILS, p=p / p.sum())
    if sweep >= DROPPED:
        kept += 1
        sums += np.log(v_)
        squares += np.log(v_) ** 2
        moved += k @ np.linalg.solve(m, y)
        noises += s2
sampled = {
    "log_sizes": list(sums / kept),
    "log_spreads": list(np.sqrt(squares / kept - (sums / kept) ** 2)),
    "moved": list(moved / kept),
    "noise": noises / kept,
}

rounded = lambda x: json.loads(json.dumps(x), parse_float=lambda text: float(f"{float(text):.12g}"))
print(
    json.dumps(
        rounded(
            {
                "covariance": [list(plain[c:, c]) for c in range(ROWS)],
                "evidence": {"sizes": list(v), "noise": noise, "moved": list(field)},
                "alone": alone,
                "left_out": left_out,
                "sampled": sampled,
            }
        ),
        separators=(",", ":"),
    )
)
