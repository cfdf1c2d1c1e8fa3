"""The wheel holds the program without Parquet, which says so before it works."""

from pathlib import Path

import calibench as cb
import pytest
from calibench._program import run
from conftest import ROOT


def test_parquet(tmp_path: Path) -> None:
    outputs = ["-o", tmp_path / "t.csv", "--parquet", tmp_path / "t.parquet"]
    with pytest.raises(cb.InputError, match="--features parquet"):
        run(["sim", "study", ROOT / "scenarios" / "table8.toml", "--trials", "2", *outputs])
    assert not any(tmp_path.iterdir())
