"""Other regressors on the same divisions: rivals.py FOLDER, a folder that `calibench effects prove --rows` has filled.

Each corrects the default model: it learns, from the fitted rows, what that model leaves at given joint angles, and is judged on the rows left out.
Prints one JSON document: for every file, the rms of what a Gaussian process and boosted trees leave over the rms of what the default model leaves.
"""

import csv
import json
import sys
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from sklearn.ensemble import GradientBoostingRegressor, HistGradientBoostingRegressor
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
from threadpoolctl import threadpool_limits

Array = NDArray[np.float64]
#: What is learned from joint angles (rad) and errors (mm), told at others: errors there, mm.
Regressor = Callable[[Array, Array, Array], Array]

#: A Gaussian process costs the cube of its rows: so many are drawn to find its widths, and so many to carry it.
WIDTHS_FROM, CARRIED_BY = 400, 600
#: Of fewer rows, the bins of histograms are too coarse.
BINS_FROM = 500


class Rows:
    """A file of rows: what was fitted or judged, joint angles in rad, errors of the default model in mm, free balls by name."""

    def __init__(self, path: Path) -> None:
        with path.open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        joints = [name for name in rows[0] if name.startswith("q") and name.endswith("_deg")]
        self.fitted = np.array([row["part"] == "fitted" for row in rows])
        self.joints: Array = np.radians([[float(row[name]) for name in joints] for row in rows])
        self.errors: Array = np.array([[float(row[f"error_{axis}_mm"]) for axis in "xyz"] for row in rows])
        self.balls = np.array([row["free_ball"] for row in rows])


def drawn(rows: int, most: int) -> NDArray[np.int64]:
    """Places of at most so many of the rows, the same every time."""
    return np.sort(np.random.default_rng(1).permutation(rows)[:most])


def gaussian_process(joints: Array, errors: Array, others: Array) -> Array:
    """A process for each axis: a width for each joint, and white noise, by the evidence."""
    few, many = drawn(len(joints), WIDTHS_FROM), drawn(len(joints), CARRIED_BY)
    told = np.empty((len(others), 3))
    for axis in range(3):
        size = errors[:, axis].std() or 1.0
        widths = RBF(np.full(joints.shape[1], 1.0), (0.05, 100.0))
        kernel = ConstantKernel(0.5, (1e-4, 1e2)) * widths + WhiteKernel(0.5, (1e-5, 1e1))
        found = GaussianProcessRegressor(kernel, random_state=1).fit(joints[few], errors[few, axis] / size)
        carried = GaussianProcessRegressor(found.kernel_, optimizer=None).fit(joints[many], errors[many, axis] / size)
        told[:, axis] = size * carried.predict(others)
    return told


def boosted_trees(joints: Array, errors: Array, others: Array) -> Array:
    """Trees for each axis, slowly learned."""
    told = np.empty((len(others), 3))
    for axis in range(3):
        if len(joints) < BINS_FROM:
            trees = GradientBoostingRegressor(n_estimators=200, learning_rate=0.05, subsample=0.7, random_state=1)
        else:
            trees = HistGradientBoostingRegressor(max_iter=300, learning_rate=0.05, early_stopping=False, random_state=1)
        told[:, axis] = trees.fit(joints, errors[:, axis]).predict(others)
    return told


def left(rows: Rows, correction: Array) -> float:
    """Rms of the 3-D error that a correction leaves on the judged rows, mm. A ball that no fitted row has stands where these rows say."""
    judged = ~rows.fitted
    errors, balls = rows.errors[judged] - correction, rows.balls[judged]
    for ball in set(balls) - set(rows.balls[rows.fitted]) - {""}:
        errors[balls == ball] -= errors[balls == ball].mean(axis=0)
    return float(np.sqrt((errors**2).sum(axis=1).mean()))


def ratio(rows: Rows, regressor: Regressor) -> float:
    """What the default model leaves when it is so corrected, over what it leaves alone."""
    fitted, judged = rows.fitted, ~rows.fitted
    correction = regressor(rows.joints[fitted], rows.errors[fitted], rows.joints[judged])
    return left(rows, correction) / left(rows, np.zeros_like(correction))


def main() -> None:
    warnings.simplefilter("ignore", ConvergenceWarning)
    files = sorted(Path(sys.argv[1]).glob("*.csv"))
    if not files:
        sys.exit(f"{sys.argv[1]}: there is no CSV file; make them by calibench effects prove --rows")
    divisions = {}
    # Matrices this small are shared out at a loss.
    with threadpool_limits(1):
        for path in files:
            rows = Rows(path)
            divisions[path.name] = {"gaussian_process": ratio(rows, gaussian_process), "boosted_trees": ratio(rows, boosted_trees)}
    json.dump({"format": "calibench-rivals/1", "divisions": divisions}, sys.stdout, indent=1)
    print()


if __name__ == "__main__":
    main()
