"""Pinocchio: from C++, and its Python."""

import ctypes
from pathlib import Path

import cmeel
import numpy as np
import pinocchio

from compiled import address, library
from works import (
    GOLDEN,
    GRAVITY,
    NOMINAL,
    TOOL,
    Peer,
    expect_kinematics,
    expect_torques,
    golden_configurations,
    random_configurations,
)

#: Configurations of one run: their results stay in the second cache.
BATCH = 400
HERE = Path(__file__).resolve().parent
PREFIX = Path(cmeel.__file__).resolve().parent.parent / "cmeel.prefix"
#: Header-only, as Pinocchio's own CMake targets define it.
HEADERS = [
    "-std=c++17",
    "-w",
    f"-I{PREFIX / 'include'}",
    f"-I{PREFIX / 'include/eigen3'}",
    "-DBOOST_MPL_LIMIT_LIST_SIZE=30",
    "-DBOOST_MPL_LIMIT_VECTOR_SIZE=30",
    "-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS",
    "-DBOOST_FUSION_INVOKE_MAX_ARITY=12",
]


class InCpp:
    """`pinocchio_peer.cpp` on the arm of the URDF."""

    def __init__(self, model: pinocchio.Model) -> None:
        """From Pinocchio's model of it."""
        self.library = library(HERE / "pinocchio_peer.cpp", *HEADERS)
        self.library.arm.restype = ctypes.c_void_p
        joints = np.concatenate(
            [
                np.concatenate([m.rotation.ravel(), m.translation, [i.mass], i.lever, i.inertia.ravel()])
                for m, i in zip(model.jointPlacements[1:], model.inertias[1:], strict=True)
            ]
        )
        self.arm = ctypes.c_void_p(self.library.arm(address(joints), address(NOMINAL), address(TOOL)))

    def w1(self, q: np.ndarray) -> np.ndarray:
        """TCP (3), columns (31 x 3) and torques (6) of configurations (n, 6)."""
        result = np.empty((len(q), 102))
        self.library.w1(self.arm, address(q), ctypes.c_long(len(q)), address(result))
        return result

    def w5(self, q: np.ndarray) -> np.ndarray:
        """Torques (n, 6) of configurations (n, 6)."""
        tau = np.empty_like(q)
        self.library.w5(self.arm, address(q), ctypes.c_long(len(q)), address(tau))
        return tau


def in_python(model: pinocchio.Model, data: pinocchio.Data, q: np.ndarray) -> np.ndarray:
    """Torques of configurations (n, 6), one call each."""
    return np.array([pinocchio.computeGeneralizedGravity(model, data, one) for one in q])


def peers() -> list[Peer]:
    """W1, W5."""
    model = pinocchio.buildModelFromUrdf(str(GOLDEN / "kr6.urdf"))
    model.gravity.linear = np.array([0.0, 0.0, -GRAVITY])
    data = model.createData()
    cpp = InCpp(model)
    result = cpp.w1(golden_configurations())
    expect_kinematics("Pinocchio, C++", result[:, :3], result[:, 3:96].reshape(-1, 31, 3).transpose(0, 2, 1), result[:, 96:])
    expect_torques("Pinocchio, C++", cpp.w5(golden_configurations()))
    expect_torques("Pinocchio, Python", in_python(model, data, golden_configurations()))
    q = random_configurations(BATCH)
    return [
        Peer("W1", "Pinocchio, C++", BATCH, lambda: cpp.w1(q)),
        Peer("W5", "Pinocchio, C++", BATCH, lambda: cpp.w5(q)),
        Peer("W5", "Pinocchio, Python", BATCH, lambda: in_python(model, data, q)),
    ]
