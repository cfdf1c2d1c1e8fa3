"""What the tests share: the program, and public measurements."""

import io
import lzma
import os
from pathlib import Path

import pandas as pd
import pytest

ROOT = Path(os.environ["CALIBENCH_ROOT"])
JOINTS = [f"joint_{k}" for k in range(1, 7)]
POINTS = ["x", "y", "z"]


@pytest.fixture(scope="session")
def measured() -> pd.DataFrame:
    """A UR5 by laser tracker: 1,000 postures of a grid."""
    packed = ROOT / "tests/data/ur5-jacobi/3D_UR5_uncalibrated_grid_cleaned.csv.xz"
    frame = pd.read_csv(io.StringIO(lzma.decompress(packed.read_bytes()).decode()))
    for axis in POINTS:
        frame[axis] = frame[f"{axis}_t"] - frame[f"{axis}_dif"]
    return frame
