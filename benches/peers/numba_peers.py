"""numba: one configuration at a time in compiled scalar loops."""

import numpy as np
from numba import njit

from works import (
    ALPHA_0,
    D_1,
    GRAVITY,
    MASS,
    MOMENT,
    NOMINAL,
    TOOL,
    Peer,
    expect_kinematics,
    expect_torques,
    golden_configurations,
    random_configurations,
)

Array = np.ndarray

#: Configurations of one run: their results stay in the second cache.
BATCH = 400
COS_ALPHA, SIN_ALPHA = (np.round(f([ALPHA_0, *NOMINAL[6:11]]), 15) for f in (np.cos, np.sin))
A, D, OFFSET = np.array([0.0, *NOMINAL[11:16]]), np.array([D_1, 0.0, *NOMINAL[16:20]]), np.array([0.0, *NOMINAL[20:25]])
BASE, REACH = NOMINAL[:3].copy(), TOOL[:3].copy()


@njit(error_model="numpy", fastmath=True)
def pose(q: Array, origins: Array, axes: Array) -> None:
    """Origins (7, 3) and axes (7, axis, 3) of base and links (paper Eq. 1)."""
    for r in range(3):
        origins[0, r] = BASE[r]
        for k in range(3):
            axes[0, k, r] = 1.0 if k == r else 0.0
    for i in range(6):
        cos, sin, ca, sa = np.cos(q[i] + OFFSET[i]), np.sin(q[i] + OFFSET[i]), COS_ALPHA[i], SIN_ALPHA[i]
        for r in range(3):
            x, y, z = axes[i, 0, r], ca * axes[i, 1, r] + sa * axes[i, 2, r], ca * axes[i, 2, r] - sa * axes[i, 1, r]
            axes[i + 1, 0, r] = cos * x + sin * y
            axes[i + 1, 1, r] = cos * y - sin * x
            axes[i + 1, 2, r] = z
            origins[i + 1, r] = origins[i, r] + A[i] * x + D[i] * z


@njit(error_model="numpy", fastmath=True)
def weigh(origins: Array, axes: Array, tau: Array) -> None:
    """Holding torques dU/dq, N m: each joint carries the links beyond it, by their sum of moments."""
    mass, x, y = 0.0, 0.0, 0.0
    for i in range(6, 0, -1):
        link = axes[i]
        m, c = MASS[i - 1], MOMENT[i - 1]
        mass += m
        x += m * origins[i, 0] + c[0] * link[0, 0] + c[1] * link[1, 0] + c[2] * link[2, 0]
        y += m * origins[i, 1] + c[0] * link[0, 1] + c[1] * link[1, 1] + c[2] * link[2, 1]
        tau[i - 1] = GRAVITY * (link[2, 0] * (y - mass * origins[i, 1]) - link[2, 1] * (x - mass * origins[i, 0]))


@njit(error_model="numpy", fastmath=True)
def about(axis: Array, origin: Array, point: Array, column: Array) -> None:
    """Derivative of a point by a turn about an axis."""
    x, y, z = point[0] - origin[0], point[1] - origin[1], point[2] - origin[2]
    column[0] = axis[1] * z - axis[2] * y
    column[1] = axis[2] * x - axis[0] * z
    column[2] = axis[0] * y - axis[1] * x


@njit(error_model="numpy", fastmath=True)
def w1(q: Array, tcp: Array, columns: Array, tau: Array) -> None:
    """TCPs (n, 3), columns (n, 31, 3) and torques (n, 6) of configurations (n, 6) of the nominal arm."""
    origins, axes = np.empty((7, 3)), np.empty((7, 3, 3))
    for n in range(len(q)):
        pose(q[n], origins, axes)
        weigh(origins, axes, tau[n])
        point, column = tcp[n], columns[n]
        for r in range(3):
            point[r] = origins[6, r] + REACH[0] * axes[6, 0, r] + REACH[1] * axes[6, 1, r] + REACH[2] * axes[6, 2, r]
        for k in range(3):
            for r in range(3):
                column[k, r] = axes[0, k, r]
            about(axes[0, 2 - k], BASE, point, column[3 + k])
        for i in range(5):
            about(axes[i + 1, 0], origins[i + 1], point, column[6 + i])
            about(axes[i + 2, 2], origins[i + 2], point, column[20 + i])
            for r in range(3):
                column[11 + i, r] = axes[i + 1, 0, r]
                column[26 + i, r] = tau[n, i + 1] * column[20 + i, r]
        for i in range(4):
            for r in range(3):
                column[16 + i, r] = axes[i + 3, 2, r]
        about(axes[2, 1], origins[3], point, column[25])


@njit(error_model="numpy", fastmath=True)
def w5(q: Array, tau: Array) -> None:
    """Torques (n, 6) of configurations (n, 6)."""
    origins, axes = np.empty((7, 3)), np.empty((7, 3, 3))
    for n in range(len(q)):
        pose(q[n], origins, axes)
        weigh(origins, axes, tau[n])


def peers() -> list[Peer]:
    """W1, W5."""
    q = golden_configurations()
    tcp, columns, tau = np.empty((len(q), 3)), np.empty((len(q), 31, 3)), np.empty((len(q), 6))
    w1(q, tcp, columns, tau)
    expect_kinematics("numba", tcp, columns.transpose(0, 2, 1), tau)
    tau[:] = np.nan
    w5(q, tau)
    expect_torques("numba", tau)
    q = random_configurations(BATCH)
    tcp, columns, tau = np.empty((BATCH, 3)), np.empty((BATCH, 31, 3)), np.empty((BATCH, 6))
    return [
        Peer("W1", "numba", BATCH, lambda: w1(q, tcp, columns, tau)),
        Peer("W5", "numba", BATCH, lambda: w5(q, tau)),
    ]
