"""A Fourier series in the angles of joints 2 and 3 on the residual of the default model, with ridge.

Gravity and the gears of the two joints that carry the arm make errors that are periodic in (q2, q3) and turn with joint 1: the residual is
expressed in axes that turn with it. The number of harmonics and the ridge are those with the least error on postures left out, five parts.
"""

import numpy as np
from division import Array, Rows, read, write

ORDERS = (0, 1, 2, 3)
#: Over the number of rows: from none to far more than the columns.
RIDGES = (1e-4, 1e-3, 1e-2, 1e-1, 1.0)
PARTS = 5


def columns(joints: Array, order: int) -> Array:
    """Cosines and sines of k q2 + l q3, up to that order in each, with the constant."""
    made = [np.ones(len(joints))]
    for k in range(order + 1):
        for m in range(-order, order + 1):
            if k > 0 or m > 0:
                angle = k * joints[:, 1] + m * joints[:, 2]
                made += [np.cos(angle), np.sin(angle)]
    return np.array(made).T


def about_joint_1(joints: Array, vectors: Array, sign: float) -> Array:
    """Vectors turned about the axis of joint 1 by its angle."""
    c, s = np.cos(joints[:, 0]), sign * np.sin(joints[:, 0])
    return np.column_stack([c * vectors[:, 0] - s * vectors[:, 1], s * vectors[:, 0] + c * vectors[:, 1], vectors[:, 2]])


def series(rows: Rows, others: Array, order: int, ridge: float) -> Array:
    """The residual at other joints, mm (n x 3)."""
    design = columns(rows.joints, order)
    values = about_joint_1(rows.joints, rows.residual, -1.0)
    weights = np.full(design.shape[1], ridge * len(rows))
    found = np.linalg.solve(design.T @ design + np.diag(weights), design.T @ values)
    return about_joint_1(others, columns(others, order) @ found, 1.0)


def left_out(rows: Rows, order: int, ridge: float) -> float:
    """Mean 3-D error on postures left out, mm."""
    part = rows.posture % PARTS
    lengths = []
    for k in set(part):
        told = series(rows[part != k], rows.joints[part == k], order, ridge)
        lengths.append(np.linalg.norm(rows.residual[part == k] - told, axis=1))
    return float(np.concatenate(lengths).mean())


division = read()
fitted = division.fitted[division.fitted.is_fit]
expected, order, ridge = min((left_out(fitted, order, ridge), order, ridge) for order in ORDERS for ridge in RIDGES)
predicted = division.judged.default + series(fitted, division.judged.joints, order, ridge)
write(division, predicted, np.full(len(predicted), expected))
