"""JAX: compiled for one configuration or robot, then side by side by `vmap`. Compiling is not timed."""

import jax
import jax.numpy as jnp
import numpy as np
import scipy.optimize

from arm import columns, frames, tcp, torques
from works import (
    NOMINAL,
    Peer,
    ball_poses,
    expect_identification,
    expect_kinematics,
    expect_torques,
    golden_configurations,
    random_configurations,
)

jax.config.update("jax_enable_x64", True)

#: Configurations at once: their results stay in the second cache.
BATCH = 200
DRAWING = jnp.array(NOMINAL)
#: What XLA would otherwise work out again wherever it is used.
once = jax.lax.optimization_barrier


def w1(q: jax.Array) -> tuple[jax.Array, jax.Array, jax.Array]:
    """TCP, columns and torques of a configuration (6) of the nominal arm."""
    chain = once(frames(jnp, DRAWING, q))
    tau = once(torques(jnp, chain))
    return tcp(chain), columns(jnp, DRAWING, chain, tau), tau


def w5(q: jax.Array) -> jax.Array:
    """Torques of a configuration (6)."""
    return torques(jnp, frames(jnp, DRAWING, q))


@jax.jit
def residuals(rho: jax.Array, balls: jax.Array, q: jax.Array, tau: jax.Array) -> jax.Array:
    """TCP less ball of poses (6, n), m."""
    return (tcp(frames(jnp, rho[:, None], q, tau)) - balls).ravel()


jacobian = jax.jit(jax.jacfwd(residuals))
weigh = jax.jit(w5)


def identify_by_scipy(balls: jax.Array, q: jax.Array) -> np.ndarray:
    """Parameters from poses (6, n) at balls (3, n): MINPACK's Levenberg-Marquardt, residuals and Jacobian by JAX."""
    data = (balls, q, weigh(q))
    return scipy.optimize.least_squares(residuals, NOMINAL, jacobian, method="lm", x_scale="jac", xtol=1e-12, args=data).x


@jax.jit
def identify(balls: jax.Array, q: jax.Array) -> jax.Array:
    """The same by Gauss-Newton on normal equations with scaled columns, compiled as a whole."""
    tau = once(w5(q))

    def step(state: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        rho, _ = state
        by_parameters = once(jacobian(rho, balls, q, tau))
        scale = 1 / jnp.linalg.norm(by_parameters, axis=0)
        by_parameters = once(by_parameters * scale)
        step = jnp.linalg.solve(by_parameters.T @ by_parameters, -by_parameters.T @ residuals(rho, balls, q, tau))
        return rho + scale * step, jnp.linalg.norm(step)

    return jax.lax.while_loop(lambda state: state[1] >= 1e-12, step, (DRAWING, jnp.inf))[0]


def peers() -> list[Peer]:
    """W1, W2, W5."""
    golden = jnp.array(golden_configurations())
    many_w1, many_w5 = jax.jit(jax.vmap(w1)), jax.jit(jax.vmap(w5))
    tcps, by_parameters, tau = many_w1(golden)
    expect_kinematics("JAX", tcps, by_parameters.transpose(0, 2, 1), tau)
    expect_torques("JAX", many_w5(golden))
    balls, measured = (jnp.array(table.T) for table in ball_poses("w2_measured.csv"))
    expect_identification("scipy, Jacobian by JAX", identify_by_scipy(balls, measured))
    expect_identification("JAX", identify(balls, measured))
    q = jnp.array(random_configurations(BATCH))
    return [
        Peer("W1", "JAX", BATCH, lambda: jax.block_until_ready(many_w1(q))),
        Peer("W5", "JAX", BATCH, lambda: jax.block_until_ready(many_w5(q))),
        Peer("W2", "scipy, Jacobian by JAX", 1, lambda: identify_by_scipy(balls, measured)),
        Peer("W2", "JAX, Gauss-Newton", 1, lambda: jax.block_until_ready(identify(balls, measured))),
    ]
