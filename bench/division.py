"""What every rival of the benchmark shares: the files of a division, and where base and tool are under a rival's own arm.

A rival is a script that is called with the folder of a division: it reads `fitted.csv`, `judged.csv` and `robot.json`, and writes `predicted.csv`.
`template.py` needs nothing of this but `read` and `write`.
"""

import csv
import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
#: Poses of the last frame of the arm in the frame of its base, mm (n x 4 x 4), at joint positions, rad (n x N).
Arm = Callable[[Array], Array]


@dataclass
class Rows:
    """Rows of a division. Lengths are in mm and in the frame of the robot's base, angles in rad."""

    #: Number of the posture; repeats share it.
    posture: NDArray[np.int64]
    #: False of the rows that only tell where base and tool of a campaign are that was left out.
    is_fit: NDArray[np.bool_]
    #: Name of the measured point of the tool and of its set-up.
    tool: NDArray[np.str_]
    #: Name of the ball if nobody measured where it is, otherwise empty.
    ball: NDArray[np.str_]
    #: Joint positions, rad (n x N).
    joints: Array
    #: Position of the measured point by the default model of calibench, mm (n x 3).
    default: Array
    #: Position as measured, mm (n x 3); NaN on judged rows.
    measured: Array

    @property
    def residual(self) -> Array:
        """Measured minus default, mm (n x 3)."""
        return self.measured - self.default

    def __getitem__(self, chosen: NDArray[Any]) -> "Rows":
        return Rows(*(getattr(self, name)[chosen] for name in self.__dataclass_fields__))

    def __len__(self) -> int:
        return len(self.joints)


@dataclass
class Division:
    """A division of measurements: rows to learn from, rows to predict, and the nominal robot as `robot.json` has it."""

    folder: Path
    fitted: Rows
    judged: Rows
    robot: dict[str, Any]

    @property
    def links(self) -> list[dict[str, float]]:
        """The links from the base on, in rad and mm: alpha, a, beta, theta, d."""
        angles = ("alpha", "beta", "theta")
        return [
            {**{name: float(np.radians(link[f"{name}_deg"])) for name in angles}, "a": link["a_mm"], "d": link["d_mm"]}
            for link in self.robot["links"]
        ]


def read_rows(path: Path) -> Rows:
    """Reads one file of rows; whoever gives another kind of file gets a KeyError with the name of the missing column."""
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    titles = [name for name in rows[0] if name[0] == "q" and name.endswith(("_deg", "_mm"))]
    units = np.array([np.pi / 180.0 if name.endswith("_deg") else 1.0 for name in titles])

    def three(name: str) -> Array:
        return np.array([[float(row.get(f"{name}_{axis}_mm", "nan")) for axis in "xyz"] for row in rows])

    return Rows(
        posture=np.array([int(row["posture"]) for row in rows]),
        is_fit=np.array([row["use"] == "fit" for row in rows]),
        tool=np.array([row["tool"] for row in rows]),
        ball=np.array([row["ball"] for row in rows]),
        joints=np.array([[float(row[name]) for name in titles] for row in rows]) * units,
        default=three("default"),
        measured=three("measured"),
    )


def read() -> Division:
    """The division whose folder is the argument of the script."""
    if len(sys.argv) != 2:
        sys.exit(f"{sys.argv[0]}: give the folder of a division, which holds fitted.csv, judged.csv and robot.json")
    folder = Path(sys.argv[1])
    robot = json.loads((folder / "robot.json").read_text(encoding="utf-8"))
    return Division(folder, read_rows(folder / "fitted.csv"), read_rows(folder / "judged.csv"), robot)


def write(division: Division, predicted: Array, expected: Array | None = None) -> None:
    """Writes the predicted positions of the judged rows, mm (n x 3), and if given the expected 3-D errors, mm (n)."""
    titles = ["x_mm", "y_mm", "z_mm"] + (["expected_mm"] if expected is not None else [])
    table = predicted if expected is None else np.column_stack([predicted, expected])
    with (division.folder / "predicted.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(titles)
        writer.writerows([[f"{x:.6f}" for x in row] for row in table])


def correct(division: Division, regressor: Callable[[Array, Array, Array], Array]) -> None:
    """Adds to the default model what a regressor of joints (rad) and residuals (mm) says of its error at the judged joints."""
    fitted = division.fitted[division.fitted.is_fit]
    write(division, division.judged.default + regressor(fitted.joints, fitted.residual, division.judged.joints))


def transform(link: dict[str, float], angle: float) -> Array:
    """The row `Rx(alpha) Tx(a) Ry(beta) Rz(theta + q) Tz(d)` of a revolute joint as a matrix (4 x 4), mm."""
    (sa, sb, st), (ca, cb, ct) = (f(np.array([link["alpha"], link["beta"], link["theta"] + angle])) for f in (np.sin, np.cos))
    rx = np.array([[1.0, 0.0, 0.0], [0.0, ca, -sa], [0.0, sa, ca]])
    ry = np.array([[cb, 0.0, sb], [0.0, 1.0, 0.0], [-sb, 0.0, cb]])
    rz = np.array([[ct, -st, 0.0], [st, ct, 0.0], [0.0, 0.0, 1.0]])
    whole = np.eye(4)
    whole[:3, :3] = rx @ ry @ rz
    whole[:3, 3] = rx @ np.array([link["a"], 0.0, 0.0]) + whole[:3, :3] @ np.array([0.0, 0.0, link["d"]])
    return whole


def nominal_arm(division: Division) -> Arm:
    """The arm as its maker drew it."""
    links = division.links

    def poses(joints: Array) -> Array:
        found = np.empty((len(joints), 4, 4))
        for k, row in enumerate(joints):
            pose = np.eye(4)
            for link, angle in zip(links, row, strict=True):
                pose = pose @ transform(link, angle)
            found[k] = pose
        return found

    return poses


def cross(v: Array) -> Array:
    """The matrix of the product with v."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def turned(rotation: Array) -> Array:
    """The rotation matrix of a rotation vector, rad."""
    angle = float(np.linalg.norm(rotation))
    axis = cross(rotation / (angle or 1.0))
    return np.eye(3) + np.sin(angle) * axis + (1.0 - np.cos(angle)) * axis @ axis


class Seat:
    """Base and tool under which an arm meets the measured points, by least squares; every set-up has its own.

    A rival that knows only one tool fits its arm with the rows of one, and is placed on the others by this.
    A tool without rows is that of the other rows of its set-up, or of any.
    """

    #: Iterations of Gauss and Newton: the base is given to a few milliradians, so three would do.
    ROUNDS = 8

    def __init__(self, arm: Arm, rows: Rows) -> None:
        self.arm = arm
        self.setups = {name.rsplit("/", 1)[0] for name in rows.tool}
        self.base: dict[str, tuple[Array, Array]] = {}
        self.tools: dict[str, Array] = {}
        for setup in sorted(self.setups):
            self._place(setup, rows[np.array([name.rsplit("/", 1)[0] == setup for name in rows.tool])])

    def _place(self, setup: str, rows: Rows) -> None:
        poses = self.arm(rows.joints)
        names = sorted(set(rows.tool))
        which = np.array([names.index(name) for name in rows.tool])
        rotation, shift, tools = np.eye(3), np.zeros(3), np.zeros((len(names), 3))
        for _ in range(self.ROUNDS):
            inner = np.einsum("nij,nj->ni", poses[:, :3, :3], tools[which]) + poses[:, :3, 3]
            turned_points = inner @ rotation.T
            left = rows.measured - turned_points - shift
            columns = np.zeros((len(rows), 3, 6 + 3 * len(names)))
            columns[:, :, :3] = np.eye(3)
            columns[:, :, 3:6] = np.array([-cross(point) for point in turned_points])
            for k in range(len(names)):
                columns[which == k, :, 6 + 3 * k : 9 + 3 * k] = rotation @ poses[which == k, :3, :3]
            # What the data do not determine stays as it is: the shortest step.
            step = np.linalg.lstsq(columns.reshape(len(rows) * 3, -1), left.reshape(-1), rcond=1e-9)[0]
            shift = shift + step[:3]
            rotation, tools = turned(step[3:6]) @ rotation, tools + step[6:].reshape(-1, 3)
        self.base[setup] = (rotation, shift)
        self.tools.update(zip(names, tools, strict=True))

    def predict(self, rows: Rows) -> Array:
        """Positions of the points of these rows, mm (n x 3)."""
        poses = self.arm(rows.joints)
        told = np.empty((len(rows), 3))
        for k, name in enumerate(rows.tool):
            rotation, shift = self.base.get(name.rsplit("/", 1)[0], next(iter(self.base.values())))
            tool = self.tools.get(name, next(iter(self.tools.values())))
            told[k] = rotation @ (poses[k, :3, :3] @ tool + poses[k, :3, 3]) + shift
        return told


def main_tool(rows: Rows) -> Rows:
    """The rows of the tool with most of them, of those to be fitted."""
    fit = rows[rows.is_fit]
    names, counts = np.unique(fit.tool, return_counts=True)
    return fit[fit.tool == names[np.argmax(counts)]]
