"""W4 in JAX: one trial compiled as a whole, many side by side by `vmap`. Compiling is not timed."""

import jax
import jax.numpy as jnp
import numpy as np

from arm import frames, reading, rel_tool, tcp
from jax_peers import DRAWING, identify, residuals, w5
from works import CENTRED, JOINT_NOISE, MOST_READINGS, READING_NOISE, Peer, ball_poses, expect_trials, table

BALLS, STARTS = (jnp.array(rows.T) for rows in ball_poses("w2_selection.csv"))
TRUTHS, VALIDATION = jnp.array(table("w4_truth.csv")), jnp.array(table("w4_validation.csv").T)
VALIDATION_TORQUES = w5(VALIDATION)
#: Robots at once.
BATCH = 32


def centre(truth: jax.Array, key: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Joints (6, poses) where a robot (31) centred, and the readings each took."""

    def read(state: tuple) -> tuple:
        key, q, off, readings, count = state
        key, joints, plungers = jax.random.split(key, 3)
        actual = q + JOINT_NOISE * jax.random.normal(joints, q.shape)
        found = reading(jnp, frames(jnp, truth[:, None], actual, w5(q)), BALLS)
        found += READING_NOISE * jax.random.normal(plungers, found.shape)
        readings += off
        off &= jnp.abs(found).max(axis=0) >= CENTRED
        return key, jnp.where(off, rel_tool(jnp, DRAWING[:, None], q, found), q), off, readings, count + 1

    off = jnp.ones(STARTS.shape[1], dtype=bool)
    start = (key, STARTS, off, jnp.zeros(off.shape), 0)
    _, q, _, readings, _ = jax.lax.while_loop(lambda state: state[2].any() & (state[4] < MOST_READINGS), read, start)
    return q, readings


def trial(truth: jax.Array, key: jax.Array) -> jax.Array:
    """Mean and largest error, residual rms (m), readings a centring of a robot (31)."""
    q, readings = centre(truth, key)
    found = identify(BALLS, q)
    points = (tcp(frames(jnp, rho[:, None], VALIDATION, VALIDATION_TORQUES)) for rho in (truth, found))
    error = jnp.linalg.norm(jnp.subtract(*points), axis=0)
    residual = residuals(found, BALLS, q, w5(q))
    return jnp.array([error.mean(), error.max(), jnp.sqrt((residual**2).mean()), readings.mean()])


def peers() -> list[Peer]:
    """W4."""
    trials = jax.jit(jax.vmap(trial))
    keys = jax.random.split(jax.random.key(1), len(TRUTHS))
    batches = zip(TRUTHS.reshape(-1, BATCH, 31), keys.reshape(-1, BATCH), strict=True)
    expect_trials("JAX", np.concatenate([trials(*batch) for batch in batches]))
    return [Peer("W4", "JAX", BATCH, lambda: jax.block_until_ready(trials(TRUTHS[:BATCH], keys[:BATCH])))]
