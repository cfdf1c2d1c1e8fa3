"""Frames of any kind give the same dataset; what is wrong with one is said with its row and column."""

import lzma
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import calibench as cb
import numpy as np
import pandas as pd
import polars as pl
import pytest
from conftest import JOINTS, POINTS, ROOT

Frame = Any


def dataset(frame: Frame, **more: Any) -> cb.Dataset:
    given = {"robot": "ur5", "joints": JOINTS, "points": POINTS, "angles": "deg", "lengths": "mm"}
    return cb.Dataset.from_frame(frame, **{**given, **more})


def test_every_kind_of_frame_is_the_same(measured: pd.DataFrame, tmp_path: Path) -> None:
    few = measured.iloc[:60]
    expected = dataset(few)
    text = (expected.folder / "samples.csv").read_bytes()
    for other in [pl.from_pandas(few), {c: few[c].to_numpy() for c in few}, few.to_records(index=False), few.convert_dtypes(), few.set_index(np.arange(60) * 7)]:
        assert (dataset(other).folder / "samples.csv").read_bytes() == text
    # Radians and metres, told by the names of the columns.
    si = pd.DataFrame({f"j{k}_rad": np.radians(few[f"joint_{k}"]) for k in range(1, 7)} | {f"{a}_m": few[a] / 1e3 for a in POINTS})
    given = cb.Dataset.from_frame(si, robot="ur5", joints=[f"j{k}_rad" for k in range(1, 7)], points=["x_m", "y_m", "z_m"])
    for name, values in given.columns().items():
        if name not in ("id", "kind"):
            np.testing.assert_allclose(values, expected.columns()[name], rtol=1e-12, atol=1e-10)
    # Arrays out, and written and read again.
    columns = expected.columns()
    assert columns["q1_deg"].dtype == np.float64 and len(columns["id"]) == len(expected) == 60
    np.testing.assert_array_equal(columns["x_mm"], few["x"])
    kept = expected.write(tmp_path / "kept")
    del expected
    assert len(cb.Dataset.read(kept.folder).frame()) == 60
    with pytest.raises(cb.InputError, match="is there already"):
        kept.write(tmp_path / "kept")
    with pytest.raises(cb.InputError, match="is not a dataset"):
        cb.Dataset.read(tmp_path)


def test_more_than_points(measured: pd.DataFrame) -> None:
    few = measured.iloc[:60].copy()
    few["day"] = ["monday"] * 30 + ["tuesday"] * 30
    few["t"] = np.arange(60.0)
    data = dataset(few, columns={"session": "day", "time_s": "t"}, tool=(0, 0, 28), noise_um=50)
    columns = data.columns()
    assert set(columns["session"]) == {"monday", "tuesday"} and columns["time_s"].tolist() == list(range(60))
    description = (data.folder / "dataset.toml").read_text()
    assert "z_mm = 28.0" in description and "point_um = 50.0" in description and "free" not in description


def test_poses(tmp_path: Path) -> None:
    """A frame of poses is what the importer of its table reads."""
    packed = ROOT / "tests/data/ur10-ipa/Series_B/measurements_joint_configurations.csv.xz"
    path = tmp_path / packed.stem
    path.write_bytes(lzma.decompress(packed.read_bytes()))
    frame = pd.read_csv(path, sep=";", decimal=",")
    joints = [f"{part}_joint" for part in ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")]
    given = {"robot": "ur10", "joints": joints, "points": [f"measurement_{a}" for a in "xyz"], "lengths": "mm"}
    turned = frame.copy()
    turned[joints] = np.rad2deg(frame[joints])
    turns = [f"measurement_r{a}" for a in "xyz"]
    data = cb.Dataset.from_frame(turned, **given, angles="deg", orientations=turns, rotation="xyz", noise_deg=0.02)
    imported = cb.Dataset.import_("ur10-ipa", [path]).columns()
    for name in ("x_mm", "rx_deg", "ry_deg", "rz_deg", "q3_deg"):
        np.testing.assert_allclose(data.columns()[name], imported[name], rtol=0, atol=1e-9)
    # A pose without the noise of its orientation cannot be weighted.
    with pytest.raises(cb.InputError, match="orientation_deg"):
        cb.Dataset.from_frame(turned, **given, angles="deg", orientations=turns, rotation="xyz")
    with pytest.raises(cb.InputError, match="`euler` is not a form"):
        cb.Dataset.from_frame(turned, **given, angles="deg", orientations=turns, rotation="euler", noise_deg=0.02)


def test_an_arm_on_a_rail(tmp_path: Path) -> None:
    """Columns of prismatic joints are in their own unit."""
    turning = "alpha_deg = 90.0\na_mm = 300.0\nd_mm = 0.0\nmin_deg = -170.0\nmax_deg = 170.0\n"
    rail = 'kind = "prismatic"\nalpha_deg = 0.0\na_mm = 0.0\nd_mm = 0.0\nmin_mm = 0.0\nmax_mm = 3000.0\n'
    robot = tmp_path / "rail.toml"
    robot.write_text('format = "calibench-robot/1"\nname = "rail"\n' + "".join(f"[[link]]\n{link}" for link in (rail, turning, turning)))
    random = np.random.default_rng(1)
    frame = {"rail_m": random.uniform(0, 3, 20), "a": random.uniform(-1, 1, 20), "b": random.uniform(-1, 1, 20)}
    frame |= {axis: random.uniform(0, 1000, 20) for axis in "xyz"}
    given = {"robot": robot, "joints": ["rail_m", "a", "b"], "points": list("xyz"), "lengths": "mm"}
    columns = cb.Dataset.from_frame(frame, **given, angles="rad", force=True).columns()
    np.testing.assert_allclose(columns["q1_mm"], 1000 * frame["rail_m"])
    np.testing.assert_allclose(columns["q2_deg"], np.rad2deg(frame["a"]))
    with pytest.raises(cb.InputError, match="q2|joint 2"):
        cb.Dataset.from_frame({**frame, "a_mm": frame["a"]}, **{**given, "joints": ["rail_m", "a_mm", "b"]}, angles="rad", force=True)


Damage = Callable[[pd.DataFrame], Frame]


def with_value(column: str, row: int, value: object) -> Damage:
    def damage(frame: pd.DataFrame) -> pd.DataFrame:
        frame[column] = frame[column].astype(object)
        frame.loc[frame.index[row], column] = value
        return frame

    return damage


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (with_value("joint_3", 17, "x"), "row 17, column 'joint_3': 'x' is not a number"),
        (with_value("joint_3", 4, None), "row 4, column 'joint_3': None is not a number"),
        (with_value("y", 5, float("nan")), "row 5, column 'y': nan is not a finite number"),
        (with_value("y", 6, float("inf")), "row 6, column 'y': inf is not a finite number"),
        (with_value("y", 7, True), "row 7, column 'y': True is not a number"),
        (with_value("y", 8, pd.NA), "row 8, column 'y': <NA> is not a number"),
        (lambda f: f.drop(columns="z"), "there is no column 'z'; there are .*joint_1"),
        (lambda f: pl.from_pandas(f).drop("z"), "there is no column 'z'"),
        (lambda f: f.iloc[:0], "the frame has no rows"),
        (lambda f: {**{c: f[c].to_numpy() for c in f}, "z": f["z"].to_numpy()[:-1]}, "columns of different lengths: .*z 59"),
        (lambda f: {**{c: f[c].to_numpy() for c in f}, "z": np.zeros((60, 2))}, r"column 'z' has the shape \(60, 2\)"),
        (lambda f: {**{c: f[c].to_numpy() for c in f}, "z": np.ma.masked_equal(f["z"].to_numpy(), f["z"].iloc[9])}, "row 9, column 'z': is masked"),
        (lambda f: {**{c: f[c].to_numpy() for c in f}, "z": np.array(["a"] * 60)}, "column 'z' is of <U1; give numbers"),
        (lambda f: {**{c: f[c].to_numpy() for c in f}, "z": np.zeros(60, complex)}, "column 'z' is of complex128; give numbers"),
        (lambda f: f.assign(joint_2=-f["joint_2"]), "joint 2 counted the other way"),
        (lambda f: f.assign(joint_2=f["joint_2"] * 100), "samples.csv|frame.csv:.*q2"),
    ],
)
def test_what_is_wrong_is_said(measured: pd.DataFrame, damage: Damage, said: str) -> None:
    with pytest.raises(cb.InputError, match=said) as caught:
        dataset(damage(measured.iloc[:60].copy()))
    assert isinstance(caught.value, ValueError) and "panicked" not in str(caught.value)


def test_arguments_that_cannot_be(measured: pd.DataFrame) -> None:
    few = measured.iloc[:60]
    for more, said in [
        ({"angles": None}, "angles: the unit of joint_1.* is not known; give angles='deg' or 'rad'"),
        ({"angles": "gon"}, "angles: 'gon' is not a unit here"),
        ({"points": ["x", "y"]}, "points: 2 columns"),
        ({"joints": JOINTS[:5]}, "q6"),
        ({"robot": "ur55"}, "there is no robot `ur55`"),
        ({"tool": (1, 2)}, "tool: 2 numbers"),
        ({"columns": {"colour": "x"}}, "columns: there is no 'colour'"),
    ]:
        with pytest.raises(cb.InputError, match=said):
            dataset(few, **more)
    data = dataset(few)
    with pytest.raises(cb.InputError, match="effect"):
        cb.identify(data, ["base_frame", "mdhh"])
    with pytest.raises(cb.InputError, match="rows: 'some'"):
        cb.compare(cb.identify(data, ["base_frame"]), data, rows="some")
    with pytest.raises(cb.InputError, match="no such file"):
        cb.Calibration.read("nothing.toml")


def test_an_interrupt_ends_the_program(tmp_path: Path) -> None:
    """Ctrl-C in Python leaves no program behind."""
    # Where these tests run in the background, interrupts are ignored.
    code = f"import signal; signal.signal(signal.SIGINT, signal.default_int_handler); import calibench as cb; print('begun', flush=True); cb.study({str(ROOT / 'scenarios/paper.toml')!r}, trials=100000)"
    python = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)
    assert python.stdout is not None and python.stdout.readline() == "begun\n"
    children = Path(f"/proc/{python.pid}/task/{python.pid}/children")
    waited_until = time.monotonic() + 60
    while not children.read_text().split() and time.monotonic() < waited_until:
        time.sleep(0.05)
    child = Path("/proc") / children.read_text().split()[0]
    # To Python alone, as a notebook does it.
    python.send_signal(signal.SIGINT)
    _, errors = python.communicate(timeout=60)
    assert "KeyboardInterrupt" in errors and not child.exists()
