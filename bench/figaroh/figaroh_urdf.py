"""FIGAROH 1.0.2: its calibration of every joint frame of a URDF, with base and tool, and joint elasticity where the masses are listed.

The nominal robot becomes a URDF, the rows a CSV file and a configuration, as its guide to a new robot says; its parameters are those that
it finds to be identifiable, its solver the one it comes with. It is given the rows of the tool with most of them, and the others are placed on
the arm so found.
"""

import csv
import sys
import warnings
from pathlib import Path

import numpy as np
import yaml

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from division import Arm, Array, Division, Seat, main_tool, read, transform, write  # noqa: E402
from figaroh.calibration import BaseCalibration  # noqa: E402
from figaroh.calibration.calibration_tools import calc_updated_fkm  # noqa: E402
from figaroh.tools.load_robot import load_robot  # noqa: E402

#: FIGAROH works in metres, the files of the benchmark in mm.
MM = 1e-3
#: It has no default: residuals beyond this in m are taken for outliers. The data hold none so large after the default model.
OUTLIER = 0.02


class Calibration(BaseCalibration):
    """The differences of the measured coordinates, without weights: they are all positions."""

    def cost_function(self, var: Array) -> Array:
        told: Array = calc_updated_fkm(self.model, self.data, var, self.q_measured, self.calib_config)
        return self.PEE_measured - told


def rpy(rotation: Array) -> Array:
    """Roll, pitch and yaw of a URDF, rad."""
    return np.array(
        [
            np.arctan2(rotation[2, 1], rotation[2, 2]),
            np.arctan2(-rotation[2, 0], np.hypot(rotation[2, 1], rotation[2, 2])),
            np.arctan2(rotation[1, 0], rotation[0, 0]),
        ]
    )


def urdf(division: Division) -> str:
    """The nominal robot. A turn about z commutes with a shift along it, so the origin of a joint is its row at zero."""
    words = ['<robot name="arm">', '<link name="link0"/>']
    for k, (link, entry) in enumerate(zip(division.links, division.robot["links"], strict=True), 1):
        origin = transform(link, 0.0)
        xyz, turn = (" ".join(f"{x:.12g}" for x in v) for v in (origin[:3, 3] * MM, rpy(origin[:3, :3])))
        com = " ".join(f"{x * MM:.9g}" for x in entry["com_mm"])
        mass = max(entry["mass_kg"], 1e-3)
        words += [
            f'<link name="link{k}"><inertial><origin xyz="{com}"/><mass value="{mass:.9g}"/>'
            '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>',
            f'<joint name="joint{k}" type="revolute"><parent link="link{k - 1}"/><child link="link{k}"/>'
            f'<origin xyz="{xyz}" rpy="{turn}"/><axis xyz="0 0 1"/>'
            '<limit lower="-6.3" upper="6.3" effort="1000" velocity="10"/></joint>',
        ]
    return "\n".join([*words, "</robot>"])


def calibrated(division: Division) -> Arm:
    """The arm of FIGAROH, in mm."""
    rows = main_tool(division.fitted)
    count = rows.joints.shape[1]
    work = division.folder / "figaroh"
    work.mkdir(exist_ok=True)
    (work / "arm.urdf").write_text(urdf(division), encoding="utf-8")
    with (work / "rows.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["x1", "y1", "z1", *(f"joint{k + 1}" for k in range(count))])
        writer.writerows(np.hstack([rows.measured * MM, rows.joints]).tolist())
    weighed = all(link["mass_kg"] > 0.0 for link in division.robot["links"])
    freedom = [True, True, True, False, False, False]
    config = {
        "robot": {"name": "arm", "properties": {"joints": {"active_joints": [f"joint{k + 1}" for k in range(count)]}}},
        "tasks": {
            "calibration": {
                "enabled": True,
                "type": "kinematic_calibration",
                "parameters": {
                    "calibration_level": "full_params",
                    "include_non_geometric": weighed,
                    "outlier_threshold": OUTLIER,
                },
                "kinematics": {"base_frame": "universe", "tool_frame": f"link{count}"},
                "measurements": {
                    "markers": [{"name": "tip", "reference_joint": f"joint{count}", "measurable_dof": freedom}],
                    "poses": {"base_pose": [0.0] * 6, "tool_pose": [0.0] * 6},
                },
                "data": {"source_file": str(work / "rows.csv"), "number_of_samples": len(rows)},
            }
        },
    }
    (work / "config.yaml").write_text(yaml.safe_dump(config), encoding="utf-8")
    robot = load_robot(str(work / "arm.urdf"), package_dirs=str(work))
    calibration = Calibration(robot, str(work / "config.yaml"))
    calibration.calib_config.update({"known_baseframe": False, "known_tipframe": False})
    calibration.initialize()
    result = calibration.solve(enable_logging=False)
    settings = calibration.calib_config
    parameters = list(settings["param_name"])
    tool = [parameters.index(f"pEE{axis}_1") for axis in "xyz"]

    def poses(joints: Array) -> Array:
        told = dict(settings, NbSample=len(joints))

        def at(point: Array) -> Array:
            values = np.array(result.x)
            values[tool] = point
            flat: Array = calc_updated_fkm(calibration.model, calibration.data, values, joints, told)
            return flat.reshape(3, -1).T

        found = np.tile(np.eye(4), (len(joints), 1, 1))
        origin = at(np.zeros(3))
        # The frame is where its origin and the ends of its axes, one metre long, are.
        found[:, :3, :3] = np.stack([at(axis) - origin for axis in np.eye(3)], axis=2)
        found[:, :3, 3] = origin / MM
        return found

    return poses


warnings.simplefilter("ignore")
division = read()
write(division, Seat(calibrated(division), division.fitted).predict(division.judged))
