"""MuJoCo from Python."""

import mujoco
import numpy as np
from works import GOLDEN, Peer, expect_torques, golden_configurations, random_configurations

#: Configurations of one run.
BATCH = 400


def w5(model: mujoco.MjModel, data: mujoco.MjData, q: np.ndarray) -> np.ndarray:
    """Torques of configurations (n, 6): the bias of an arm at rest."""
    found = np.empty_like(q)
    for one, tau in zip(q, found, strict=True):
        data.qpos[:] = one
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_rne(model, data, 0, tau)
    return found


def peers() -> list[Peer]:
    """W5."""
    model = mujoco.MjModel.from_xml_path(str(GOLDEN / "kr6.xml"))
    data = mujoco.MjData(model)
    expect_torques("MuJoCo", w5(model, data, golden_configurations()))
    few = random_configurations(BATCH)
    return [Peer("W5", "MuJoCo, Python", BATCH, lambda: w5(model, data, few))]
