"""W4 in numpy: centrings of many robots at once, those that are done left out; their identifications, their validations."""

import numpy as np

from arm import frames, reading, rel_tool, tcp
from numpy_peers import DRAWING, identify, w5
from works import CENTRED, JOINT_NOISE, MOST_READINGS, READING_NOISE, Peer, ball_poses, expect_trials, table

BALLS, STARTS = (rows.T for rows in ball_poses("w2_selection.csv"))
TRUTHS, VALIDATION = table("w4_truth.csv"), table("w4_validation.csv").T[:, None]
VALIDATION_TORQUES = w5(VALIDATION)
#: Robots at once.
BATCH = 32


def centre(truths: np.ndarray, noise: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Joints (6, robots, poses) where robots (robots, 31) centred, and the readings each took."""
    poses = STARTS.shape[1]
    rho, q, ball = np.repeat(truths.T, poses, axis=1), np.tile(STARTS, len(truths)), np.tile(BALLS, len(truths))
    readings, left = np.zeros(q.shape[1]), np.arange(q.shape[1])
    for _ in range(MOST_READINGS):
        commanded = q[:, left]
        actual = commanded + JOINT_NOISE * noise.standard_normal(commanded.shape)
        found = reading(np, frames(np, rho[:, left], actual, w5(commanded)), ball[:, left])
        found += READING_NOISE * noise.standard_normal(found.shape)
        readings[left] += 1
        off = np.abs(found).max(axis=0) >= CENTRED
        left = left[off]
        if not len(left):
            break
        q[:, left] = rel_tool(np, DRAWING, q[:, left], found[:, off])
    return q.reshape(6, len(truths), poses), readings.reshape(len(truths), poses)


def trials(truths: np.ndarray, noise: np.random.Generator) -> np.ndarray:
    """Mean and largest error, residual rms (m), readings a centring of each robot."""
    q, readings = centre(truths, noise)
    found, residual = identify(BALLS[:, None], q)
    points = (tcp(frames(np, rho[:, :, None], VALIDATION, VALIDATION_TORQUES)) for rho in (truths.T, found))
    error = np.linalg.norm(np.subtract(*points), axis=0)
    return np.stack(
        [error.mean(axis=1), error.max(axis=1), np.sqrt((residual**2).mean(axis=(0, 2))), readings.mean(axis=1)], axis=1
    )


def peers() -> list[Peer]:
    """W4."""
    noise = np.random.default_rng(1)
    expect_trials("numpy", np.concatenate([trials(truths, noise) for truths in TRUTHS.reshape(-1, BATCH, 31)]))
    return [Peer("W4", "numpy", BATCH, lambda: trials(TRUTHS[:BATCH], noise))]
