"""The arm of the works, written once for whatever has numpy's arrays: numpy, JAX, and arrays of CasADi's symbols.

A vector is an array (3, ...), joints and torques are (6, ...), parameters (31, ...); what follows the first axis are poses,
robots, or both, and is broadcast. `xp` is the array library.
"""

from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from works import ALPHA_0, D_1, GRAVITY, MASS, MOMENT, TOOL

Array = Any


class Frame(NamedTuple):
    """Origin and axes in the world."""

    origin: Array
    x: Array
    y: Array
    z: Array


def turned(xp: ModuleType, u: Array, v: Array, angle: Array) -> tuple[Array, Array]:
    """Two axes, turned from `u` to `v` about the third."""
    cos, sin = xp.cos(angle), xp.sin(angle)
    return cos * u + sin * v, cos * v - sin * u


def placed(xp: ModuleType, frame: Frame, pose: Array) -> Frame:
    """The frame that stands in another at Tr(x, y, z) Rz Ry Rx (paper Eq. 2)."""
    origin, x, y, z = frame
    origin = origin + pose[0] * x + pose[1] * y + pose[2] * z
    x, y = turned(xp, x, y, pose[3])
    z, x = turned(xp, z, x, pose[4])
    y, z = turned(xp, y, z, pose[5])
    return Frame(origin, x, y, z)


def world_axes(dimensions: int) -> np.ndarray:
    """Axes of the world, as vectors of so many dimensions."""
    return np.eye(3).reshape(3, 3, *[1] * (dimensions - 1))


def frames(xp: ModuleType, rho: Array, q: Array, tau: Array | None = None) -> list[Frame]:
    """Base and links: T_i = Rx(alpha) Tx(a) Ry(beta) Rz(theta) Tz(d) with theta = q + offset + c tau (paper Eq. 1).

    Without `tau` nothing yields.
    """
    alpha, a, d = [ALPHA_0, *rho[6:11]], [0.0, *rho[11:16]], [D_1, 0.0, *rho[16:20]]
    chain = [placed(xp, Frame(0.0, *world_axes(q.ndim)), rho[:6])]
    for i in range(6):
        origin, x, y, z = chain[-1]
        theta = q[0] if i == 0 else q[i] + rho[19 + i] if tau is None else q[i] + rho[19 + i] + rho[25 + i] * tau[i]
        origin = origin + a[i] * x
        y, z = turned(xp, y, z, alpha[i])
        if i == 2:
            z, x = turned(xp, z, x, rho[25])
        x, y = turned(xp, x, y, theta)
        chain.append(Frame(origin + d[i] * z, x, y, z))
    return chain


def tool(xp: ModuleType, chain: list[Frame]) -> Frame:
    """The gauge in the world: its centre, m, and the directions of its plungers."""
    return placed(xp, chain[6], TOOL)


def tcp(chain: list[Frame]) -> Array:
    """Centre of the gauge in the world, m."""
    origin, x, y, z = chain[6]
    return origin + TOOL[0] * x + TOOL[1] * y + TOOL[2] * z


def torques(xp: ModuleType, chain: list[Frame]) -> Array:
    """Holding torques dU/dq, N m: each joint carries the links beyond it, by their sum of moments."""
    mass, moment, found = 0.0, 0.0, [None] * 6
    for i in reversed(range(6)):
        origin, x, y, z = (v[:2] for v in chain[i + 1])
        mass += MASS[i]
        moment = moment + MASS[i] * origin + MOMENT[i, 0] * x + MOMENT[i, 1] * y + MOMENT[i, 2] * z
        lever = moment - mass * origin
        found[i] = GRAVITY * (z[0] * lever[1] - z[1] * lever[0])
    return xp.stack(found)


def cross(xp: ModuleType, u: Array, v: Array) -> Array:
    """Cross product of vectors (3, ...)."""
    return xp.stack([u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]])


def columns(xp: ModuleType, rho: Array, chain: list[Frame], tau: Array) -> Array:
    """Derivatives of the TCP by the 31 parameters, (31, 3, ...): along an axis, or about one by its lever."""
    point, (base, *links) = tcp(chain), chain
    before = links[:5]
    world = world_axes(point.ndim)
    _, ry = turned(xp, world[0], world[1], rho[3])

    def about(axis: Array, origin: Array) -> Array:
        return cross(xp, axis, point - origin)

    theta = [about(link.z, link.origin) for link in links[1:]]
    y, _ = turned(xp, before[1].y, before[1].z, rho[7])
    found = [
        *world,
        *(about(axis, base.origin) for axis in (world[2], ry, base.x)),
        *(about(link.x, link.origin) for link in before),
        *(link.x for link in before),
        *(link.z for link in links[2:]),
        *theta,
        about(y, before[1].origin + rho[12] * before[1].x),
        *(column * tau[i] for i, column in enumerate(theta, 1)),
    ]
    return xp.stack(xp.broadcast_arrays(*found))


def reading(xp: ModuleType, chain: list[Frame], ball: Array) -> Array:
    """The three plungers' readings of a ball, m: where it is in the gauge's frame."""
    gauge = tool(xp, chain)
    return xp.stack([(axis * (ball - gauge.origin)).sum(axis=0) for axis in gauge[1:]])


def rel_tool(xp: ModuleType, rho: Array, q: Array, shift: Array) -> Array:
    """The controller's RelTool on its drawing `rho`: joints `shift` (m) away in the gauge's frame, by two Newton steps."""
    chain = frames(xp, rho, q)
    here = goal = tool(xp, chain)
    point = goal.origin + shift[0] * goal.x + shift[1] * goal.y + shift[2] * goal.z
    for step in range(2):
        if step:
            chain = frames(xp, rho, q)
            here = tool(xp, chain)
        turn = sum(cross(xp, is_, wanted) for is_, wanted in zip(here[1:], goal[1:], strict=True)) / 2
        error = xp.concatenate([point - here.origin, turn])
        turns = xp.stack([xp.broadcast_to(link.z, here.z.shape) for link in chain[1:]], axis=1)
        moves = xp.stack([cross(xp, link.z, here.origin - link.origin) for link in chain[1:]], axis=1)
        jacobian = xp.concatenate([moves, turns])
        left, right = xp.moveaxis(jacobian, (0, 1), (-2, -1)), xp.moveaxis(error, 0, -1)[..., None]
        q = q + xp.moveaxis(xp.linalg.solve(left, right)[..., 0], -1, 0)
    return q
