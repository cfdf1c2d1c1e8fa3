"""Every function gives the bytes that the program prints."""

import json
import os
import subprocess
from pathlib import Path

import calibench as cb
import numpy as np
import pandas as pd
import pytest
from conftest import JOINTS, POINTS, ROOT


@pytest.fixture(scope="module")
def data(measured: pd.DataFrame) -> cb.Dataset:
    few = measured.iloc[::8]
    return cb.Dataset.from_frame(few, robot="ur5", joints=JOINTS, points=POINTS, angles="deg", lengths="mm")


def printed(*arguments: object) -> str:
    done = subprocess.run([str(cb.program()), *(os.fspath(a) if isinstance(a, os.PathLike) else str(a) for a in arguments)], capture_output=True, text=True, encoding="utf-8", check=False)
    assert done.returncode in (0, 1), done.stderr
    return done.stdout


def test_what_judges(data: cb.Dataset, tmp_path: Path) -> None:
    model = ["base_frame", "mdh"]
    path = tmp_path / "model.toml"
    path.write_text('effects = ["base_frame", "mdh"]\n')
    calibration = cb.identify(data, model)
    written = tmp_path / "c.toml"
    calibration.write(written)
    assert calibration.json() == printed("identify", data.folder, "--model", path, "--json")
    assert str(calibration) == printed("identify", data.folder, "--model", path)
    assert str(cb.Calibration.read(written)) == written.read_text(encoding="utf-8")
    assert cb.compare(calibration, data).json() == printed("compare", written, data.folder, "--json")
    assert str(cb.compare(calibration, data, rows="all")) == printed("compare", written, data.folder, "--all")
    assert cb.validate(calibration, data).json() == printed("validate", written, data.folder, "--json")
    assert cb.validate(calibration, data, fitted=True).json() == printed("validate", written, data.folder, "--fitted", "--json")
    diagnosis = cb.diagnose(data, path)
    assert diagnosis.json() == printed("diagnose", data.folder, "--model", path, "--json")
    assert diagnosis["verdict"] in str(diagnosis) and diagnosis._repr_html_().startswith("<pre")
    assert cb.add("joint_compliance:2", data, path).json() == printed("add", "joint_compliance:2", data.folder, "--model", path, "-o", tmp_path / "m2.toml", "--json")
    assert cb.next_measurements(data, path, seed=2).json() == printed("plan", "next", data.folder, "--model", path, "--seed", 2, "--json")
    assert cb.effects().json() == printed("effects", "--json") and cb.robots().json() == printed("robots", "--json")
    page = cb.report(data, path)
    assert page.page.lstrip().lower().startswith("<!doctype html") and "srcdoc=" in page._repr_html_()


def test_a_robot_is_calibrated_in_one_call(measured: pd.DataFrame, tmp_path: Path) -> None:
    data = cb.Dataset.from_frame(measured.iloc[::8], robot="ur5", joints=JOINTS, points=POINTS, angles="deg", lengths="mm", noise_um=50)
    found = cb.calibrate(data, tolerance_mm=5.0, folder=tmp_path / "kept")
    assert found.ok and found["tolerance_mm"] == 5.0 and found["errors"]["held_out"]
    # What it prints, what it holds and what its page shows are the same numbers.
    for row in ["nominal", "calibrated"]:
        assert f"{found['errors'][row]['mean_mm']:.3f}" in str(found)
    shown = json.loads(found.report.page.split('<script type="application/json" id="data">')[1].split("</script>")[0])
    assert shown["states"] == found["errors"] and shown["judgement"]["next"] == found["next"]
    assert found.calibration.__fspath__() == str(tmp_path / "kept" / "calibration.toml")
    refused = cb.calibrate(data, tolerance_mm=0.001, folder=tmp_path / "refused")
    assert not refused.ok and refused["errors"]["calibrated"]["met"] == 0


def test_a_calibration_is_checked(measured: pd.DataFrame, tmp_path: Path) -> None:
    described = {"robot": "ur5", "joints": JOINTS, "points": POINTS, "angles": "deg", "lengths": "mm", "noise_um": 50}
    stated = cb.Dataset.from_frame(measured.iloc[::8], **described)
    later = measured.iloc[::80].copy()
    later[POINTS] += np.random.default_rng(11).normal(scale=0.05, size=(len(later), 3))
    again = cb.Dataset.from_frame(later, **described, set_up_of=stated)
    calibration = cb.identify(stated, ["base_frame", "mdh"])
    written = tmp_path / "c.toml"
    calibration.write(written)
    checked = cb.check(calibration, again, then=stated)
    assert checked.ok and checked["verdict"] == "valid"
    assert checked.json() == printed("keep", "check", written, again.folder, "--then", stated.folder, "--json")
    with pytest.raises(cb.InputError, match="is the campaign itself"):
        cb.check(calibration, stated, then=stated)
    planned = cb.check(calibration, then=stated, sentinels=3)
    assert len(planned["sentinels"]) == 3
    assert planned.json() == printed("keep", "check", written, "--then", stated.folder, "--sentinels=3", "--json")


def test_the_ladder_ends_in_a_robot(data: cb.Dataset, tmp_path: Path) -> None:
    found = cb.ladder(data)
    assert found.json() == printed("ladder", data.folder, "--json")
    assert found.calibration.json() == printed("identify", data.folder, "--model", found.model, "--json")
    found.urdf(tmp_path / "ur5.urdf")
    assert (tmp_path / "ur5.urdf").read_text().count("<joint ") >= 6
    better = found.calibration.compensate({"id": ["one"], **{k: [v] for k, v in zip(["x_mm", "y_mm", "z_mm", "a_deg", "b_deg", "c_deg"], [-430, -100, 200, 10, 5, 178], strict=True)}})
    table = better.columns()
    assert table["status"].tolist() == ["ok"] and abs(table["x_mm"][0] + 430) < 20
    assert better["compensated"] == 1 and len(better.frame()) == 1


def test_a_cell_is_simulated(tmp_path: Path) -> None:
    scenario = ROOT / "scenarios/paper.toml"
    made = cb.run(scenario, seed=3)
    assert made.json() == printed("run", scenario, "--seed", 3, "--json")
    assert {"trical", "tracker"} & set(made.datasets) or made.datasets
    some = next(iter(made.datasets.values()))
    assert len(some.frame()) == len(some) > 50
    assert len(made.columns("probings.csv")["ball"]) >= 80
    with pytest.raises(cb.InputError, match="there is no table 'nothing.csv'; there are .*probings.csv"):
        made.columns("nothing.csv")
    shards = [cb.study(scenario, trials=1, first=k) for k in range(2)]
    assert all(len(shard.frame()) >= 1 for shard in shards)
    merged = cb.merge(shards)
    assert merged.json() == printed("sim", "merge", *shards, "--json")
