"""Writes urdf_poses.json: the joints of arms of the package example-robot-data, and poses of their tool links by Pinocchio.

    python -m pip install pin==4.1.0 example-robot-data==6.0.0
    python tests/data/golden/urdf_poses.py FOLDER >urdf_poses.json

FOLDER is that of the package's robots (share/example-robot-data/robots).
"""

import json
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy
import pinocchio

POSTURES = 12
ARMS = [
    ("ur3", "ur_description/urdf/ur3_robot.urdf", "world", "tool0"),
    ("ur5", "ur_description/urdf/ur5_robot.urdf", "world", "tool0"),
    ("ur10", "ur_description/urdf/ur10_robot.urdf", "world", "tool0"),
    ("panda", "panda_description/urdf/panda.urdf", "panda_link0", "panda_hand_tcp"),
    ("kinova j2s6s200", "kinova_description/robots/kinova.urdf", "base", "j2s6s200_end_effector"),
    ("xarm7", "xarm_description/urdf/xarm7.urdf", "world", "link_eef"),
    ("z1", "z1_description/urdf/z1.urdf", "world", "link06"),
    ("so101", "so_arm_description/urdf/so101.urdf", "base_link", "gripper_link"),
    ("baxter, left", "baxter_description/urdf/baxter.urdf", "torso", "left_gripper_base_link"),
    ("talos, left", "talos_data/robots/talos_left_arm.urdf", "arm_left_1_link", "gripper_left_base_link"),
    ("tiago", "tiago_description/robots/tiago_no_hand.urdf", "torso_lift_link", "arm_tool_link"),
    ("tiago with its lift", "tiago_description/robots/tiago_no_hand.urdf", "base_footprint", "arm_tool_link"),
    ("pr2 with its lift, right", "pr2_description/urdf/pr2.urdf", "base_link", "r_gripper_palm_link"),
    ("pr2, right", "pr2_description/urdf/pr2.urdf", "torso_lift_link", "r_gripper_palm_link"),
    ("icub, left", "icub_description/robots/icub.urdf", "base_link", "l_hand"),
    ("pendulum", "double_pendulum_description/urdf/double_pendulum_continuous.urdf", "base_link", "link2"),
]


def numbers(element, name, default):
    return default if element is None or element.get(name) is None else [float(v) for v in element.get(name).split()]


def chain(path, base, tool):
    """The joints between two links, as the file has them."""
    by_child = {j.find("child").get("link"): j for j in ElementTree.parse(path).getroot().findall("joint") if j.find("child") is not None}
    joints, at = [], tool
    while at != base:
        joint = by_child[at]
        origin = joint.find("origin")
        joints.append(
            {
                "name": joint.get("name"),
                "type": joint.get("type"),
                "xyz": numbers(origin, "xyz", [0.0, 0.0, 0.0]),
                "rpy": numbers(origin, "rpy", [0.0, 0.0, 0.0]),
                "axis": numbers(joint.find("axis"), "xyz", [1.0, 0.0, 0.0]),
            }
        )
        at = joint.find("parent").get("link")
    return joints[::-1]


def poses(path, base, tool, names, random):
    model = pinocchio.buildModelFromUrdf(str(path))
    data = model.createData()
    first, last = (model.getFrameId(link, pinocchio.FrameType.BODY) for link in (base, tool))
    found = []
    for angles in random.uniform(-3.0, 3.0, (POSTURES, len(names))):
        q = pinocchio.neutral(model)
        for name, angle in zip(names, angles):
            joint = model.joints[model.getJointId(name)]
            if joint.nq == 1:
                q[joint.idx_q] = angle
            else:
                q[joint.idx_q], q[joint.idx_q + 1] = numpy.cos(angle), numpy.sin(angle)
        pinocchio.framesForwardKinematics(model, data, q)
        pose = data.oMf[first].inverse() * data.oMf[last]
        found.append({"q": angles.tolist(), "rotation": pose.rotation.tolist(), "translation": pose.translation.tolist()})
    return found


def main():
    folder = Path(sys.argv[1])
    random = numpy.random.default_rng(18)
    arms = []
    for name, file, base, tool in ARMS:
        joints = chain(folder / file, base, tool)
        turning = [j["name"] for j in joints if j["type"] != "fixed"]
        arms.append({"arm": name, "file": file, "joints": joints, "postures": poses(folder / file, base, tool, turning, random)})
    json.dump({"source": f"Pinocchio {pinocchio.__version__}, example-robot-data 6.0.0", "arms": arms}, sys.stdout)


if __name__ == "__main__":
    main()
