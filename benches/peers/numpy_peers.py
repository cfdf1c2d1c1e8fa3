"""numpy: all poses at once, in array arithmetic."""

import numpy as np

from arm import columns, frames, tcp, torques
from works import (
    BALL,
    DISK,
    NOMINAL,
    Peer,
    ball_poses,
    expect_identification,
    expect_kinematics,
    expect_readings,
    expect_torques,
    golden_configurations,
    random_centres,
    random_configurations,
)

#: Configurations at once: their arrays stay in the second cache.
BATCH = 1000
DRAWING = NOMINAL[:, None]


def w1(q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """TCP, columns and torques of configurations (6, n) of the nominal arm."""
    chain = frames(np, DRAWING, q)
    tau = torques(np, chain)
    return tcp(chain), columns(np, DRAWING, chain, tau), tau


def w5(q: np.ndarray) -> np.ndarray:
    """Torques of configurations (6, n)."""
    return torques(np, frames(np, DRAWING, q))


def identify(balls: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Parameters (31, robots) and residuals (3, robots, poses) from poses (6, robots, poses) at balls, m.

    Gauss-Newton from the drawing, on normal equations with scaled columns.
    """
    tau, rho = w5(q), np.repeat(DRAWING, q.shape[1], axis=1)
    while True:
        chain = frames(np, rho[:, :, None], q, tau)
        residual = balls - tcp(chain)
        jacobian = columns(np, rho[:, :, None], chain, tau).transpose(2, 0, 1, 3).reshape(q.shape[1], 31, -1)
        jacobian *= (scale := 1 / np.sqrt(np.einsum("tij,tij->ti", jacobian, jacobian)))[:, :, None]
        right = jacobian @ residual.transpose(1, 0, 2).reshape(q.shape[1], -1, 1)
        step = np.linalg.solve(jacobian @ jacobian.transpose(0, 2, 1), right)[..., 0]
        rho += (scale * step).T
        if np.linalg.norm(step, axis=1).max() < 1e-12:
            return rho, residual


def readings(centres: np.ndarray) -> np.ndarray:
    """Readings (3, n) of ball centres (3, n), m: a plunger's disk meets the ball with its face, or farther off with its rim."""
    square = centres * centres
    beyond = np.maximum(0.0, np.sqrt(square[[1, 2, 0]] + square[[2, 0, 1]]) - DISK)
    return centres + BALL - np.sqrt(BALL**2 - beyond * beyond)


def peers() -> list[Peer]:
    """W1, W2, W5, W6."""
    tcps, jacobian, tau = w1(golden_configurations().T)
    expect_kinematics("numpy", tcps.T, jacobian.transpose(2, 1, 0), tau.T)
    expect_torques("numpy", w5(golden_configurations().T).T)
    balls, measured = (table.T[:, None].copy() for table in ball_poses("w2_measured.csv"))
    expect_identification("numpy", identify(balls, measured)[0][:, 0])
    expect_readings("numpy", lambda centres: readings(centres.T).T)
    q = random_configurations(BATCH).T.copy()
    centres = random_centres(BATCH).T.copy()
    return [
        Peer("W1", "numpy", BATCH, lambda: w1(q)),
        Peer("W5", "numpy", BATCH, lambda: w5(q)),
        Peer("W2", "numpy, Gauss-Newton", 1, lambda: identify(balls, measured)),
        Peer("W6", "numpy", BATCH, lambda: readings(centres)),
    ]
