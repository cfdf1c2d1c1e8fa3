"""MuJoCo: from C, and its Python."""

import ctypes
from pathlib import Path

import mujoco
import numpy as np

from compiled import address, library
from works import (
    BALL,
    DISK,
    GOLDEN,
    Peer,
    expect_readings,
    expect_torques,
    golden_configurations,
    random_centres,
    random_configurations,
)

#: Configurations, or centres, of one run.
BATCH = 400
HERE, PACKAGE = Path(__file__).resolve().parent, Path(mujoco.__file__).resolve().parent
#: Half the thickness of a plunger's disk, and the distance at which it has met the ball, m.
HALF, NEAR = 1e-3, 1e-12
#: How well its advance finds a rim, m.
READ_WITHIN = 1e-13
GAUGE = f"""<mujoco><worldbody>
<geom type="cylinder" size="{DISK} {HALF}" euler="0 90 0"/>
<geom type="cylinder" size="{DISK} {HALF}" euler="90 0 0"/>
<geom type="cylinder" size="{DISK} {HALF}"/>
<geom type="sphere" size="{BALL}"/>
</worldbody></mujoco>"""


class InC:
    """`mujoco_peer.c` on a model."""

    def __init__(self, code: ctypes.CDLL, model: mujoco.MjModel) -> None:
        """Its data, as it stands."""
        self.code, self.model, self.data = code, model, mujoco.MjData(model)
        mujoco.mj_forward(model, self.data)
        self.at = ctypes.c_void_p(model._address), ctypes.c_void_p(self.data._address)

    def w5(self, q: np.ndarray) -> np.ndarray:
        """Torques (n, 6) of configurations (n, 6)."""
        tau = np.empty_like(q)
        self.code.w5(*self.at, address(q), ctypes.c_long(len(q)), address(tau))
        return tau

    def w6(self, centres: np.ndarray) -> np.ndarray:
        """Readings (n, 3) of ball centres (n, 3), m."""
        readings = np.empty_like(centres)
        lengths = (ctypes.c_double(length) for length in (BALL, HALF, NEAR))
        self.code.w6(*self.at, address(centres), ctypes.c_long(len(centres)), *lengths, address(readings))
        return readings


def in_python(model: mujoco.MjModel, data: mujoco.MjData, q: np.ndarray) -> np.ndarray:
    """Torques of configurations (n, 6): the bias of an arm at rest."""
    found = np.empty_like(q)
    for one, tau in zip(q, found, strict=True):
        data.qpos[:] = one
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_rne(model, data, 0, tau)
    return found


def peers() -> list[Peer]:
    """W5, W6."""
    code = library(HERE / "mujoco_peer.c", f"-I{PACKAGE / 'include'}", str(next(PACKAGE.glob("libmujoco.so.*"))))
    model = mujoco.MjModel.from_xml_path(str(GOLDEN / "kr6.xml"))
    arm, gauge = InC(code, model), InC(code, mujoco.MjModel.from_xml_string(GAUGE))
    q, centres = random_configurations(BATCH), random_centres(BATCH)
    expect_torques("MuJoCo, C", arm.w5(golden_configurations()))
    expect_torques("MuJoCo, Python", in_python(model, arm.data, golden_configurations()))
    expect_readings("MuJoCo, C", gauge.w6, READ_WITHIN)
    return [
        Peer("W5", "MuJoCo, C", BATCH, lambda: arm.w5(q)),
        Peer("W5", "MuJoCo, Python", BATCH, lambda: in_python(model, arm.data, q)),
        Peer("W6", "MuJoCo, distances, C", BATCH, lambda: gauge.w6(centres)),
    ]
