"""scipy's least squares with differences of the residuals: on arrays, and as a script of 4 x 4 matrices, pose after pose."""

from math import cos, sin

import numpy as np
import scipy.optimize

from arm import frames, tcp
from numpy_peers import w5
from works import ALPHA_0, D_1, NOMINAL, TOOL, Peer, ball_poses, expect_identification


def transform(x: float, y: float, z: float, rz: float, ry: float, rx: float) -> np.ndarray:
    """Tr(x, y, z) Rz Ry Rx (paper Eq. 2)."""
    ca, sa, cb, sb, cg, sg = cos(rz), sin(rz), cos(ry), sin(ry), cos(rx), sin(rx)
    return np.array(
        [
            [ca * cb, ca * sb * sg - sa * cg, ca * sb * cg + sa * sg, x],
            [sa * cb, sa * sb * sg + ca * cg, sa * sb * cg - ca * sg, y],
            [-sb, cb * sg, cb * cg, z],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def link(alpha: float, a: float, beta: float, theta: float, d: float) -> np.ndarray:
    """Rx(alpha) Tx(a) Ry(beta) Rz(theta) Tz(d) (paper Eq. 1)."""
    return (
        transform(a, 0, 0, 0, 0, alpha)
        @ transform(0, 0, 0, 0, beta, 0)
        @ transform(0, 0, 0, theta, 0, 0)
        @ transform(0, 0, d, 0, 0, 0)
    )


def script_residuals(rho: np.ndarray, balls: np.ndarray, q: np.ndarray, tau: np.ndarray) -> np.ndarray:
    """TCP less ball of poses (n, 6), m, by products of matrices."""
    alpha, a, d = [ALPHA_0, *rho[6:11]], [0.0, *rho[11:16]], [D_1, 0.0, *rho[16:20]]
    offset, compliance = [0.0, *rho[20:25]], [0.0, *rho[26:31]]
    found = []
    for ball, joints, torques in zip(balls, q, tau, strict=True):
        pose = transform(*rho[:6])
        for i in range(6):
            pose = pose @ link(
                alpha[i], a[i], rho[25] if i == 2 else 0.0, joints[i] + offset[i] + compliance[i] * torques[i], d[i]
            )
        found.append((pose @ transform(*TOOL))[:3, 3] - ball)
    return np.concatenate(found)


def array_residuals(rho: np.ndarray, balls: np.ndarray, q: np.ndarray, tau: np.ndarray) -> np.ndarray:
    """TCP less ball of poses (6, n), m, all at once."""
    return (tcp(frames(np, rho[:, None], q, tau)) - balls).ravel()


def by_script(balls: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Parameters from poses (n, 6) at balls (n, 3)."""
    return scipy.optimize.least_squares(
        script_residuals, NOMINAL, method="lm", x_scale="jac", xtol=1e-12, args=(balls, q, w5(q.T).T)
    ).x


def on_arrays(balls: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Parameters from poses (6, n) at balls (3, n)."""
    return scipy.optimize.least_squares(
        array_residuals, NOMINAL, method="lm", x_scale="jac", xtol=1e-12, args=(balls, q, w5(q))
    ).x


def peers() -> list[Peer]:
    """W2."""
    balls, q = ball_poses("w2_measured.csv")
    expect_identification("scipy, script", by_script(balls, q))
    expect_identification("scipy, arrays", on_arrays(balls.T, q.T))
    return [
        Peer("W2", "scipy, differences, script of 4 x 4 matrices", 1, lambda: by_script(balls, q)),
        Peer("W2", "scipy, differences, numpy arrays", 1, lambda: on_arrays(balls.T, q.T)),
    ]
