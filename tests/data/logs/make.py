"""Makes the recordings beside this file, and what is true of them: make.py [FOLDER].

A UR5 with errors of its own stands still at forty postures; a tracker or a camera, 0.12 s late, sees a point or a board on its flange all the time.
Written by `rosbags` 0.11.9 and `mcap-ros2-support` 0.6.0 (PyPI), which share no code with calibench; the kinematics are standard DH in numpy.
"""

import sys
from pathlib import Path

import numpy as np
from mcap.writer import CompressionType
from mcap_ros2.writer import Writer as McapWriter
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

A = [0, -0.425, -0.39225, 0, 0, 0]
D = [0.089159, 0, 0, 0.10915, 0.09465, 0.0823]
ALPHA = [np.pi / 2, 0, 0, np.pi / 2, -np.pi / 2, 0]
# The order in which the driver of Universal Robots states the joints, and where they stand in the arm.
NAMES = ["elbow_joint", "shoulder_lift_joint", "shoulder_pan_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"]
ORDER = [2, 1, 0, 3, 4, 5]
POSES, MOVE, REST = 40, 0.6, 1.3
JOINT_RATE, SEEN_RATE, DELAY, BEGIN = 20.0, 10.0, 0.12, 1_700_000_000.0
WORLD = np.array([[0.8, -0.6, 0, 1.5], [0.6, 0.8, 0, -0.7], [0, 0, 1, 0.4], [0, 0, 0, 1.0]])
TOOLS = np.array([[0.03, -0.02, 0.11], [0.03, 0.06, 0.11]])


class Arm:
    def __init__(self, random):
        self.theta, self.alpha = random.normal(0, np.radians(0.15), 6), random.normal(0, np.radians(0.05), 6)
        self.a, self.d = random.normal(0, 4e-4, 6), random.normal(0, 4e-4, 6)

    def pose(self, q):
        pose = WORLD
        for i in range(6):
            (s, c), (sa, ca) = ((np.sin(v), np.cos(v)) for v in (q[i] + self.theta[i], ALPHA[i] + self.alpha[i]))
            a, d = A[i] + self.a[i], D[i] + self.d[i]
            pose = pose @ np.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]])
        return pose


def quaternion(turn):
    """x, y, z, w by the eigenvector of Bar-Itzhack's matrix."""
    m = turn
    k = np.array([
        [m[0, 0] - m[1, 1] - m[2, 2], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0], m[2, 1] - m[1, 2]],
        [m[0, 1] + m[1, 0], m[1, 1] - m[0, 0] - m[2, 2], m[1, 2] + m[2, 1], m[0, 2] - m[2, 0]],
        [m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], m[2, 2] - m[0, 0] - m[1, 1], m[1, 0] - m[0, 1]],
        [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], m[0, 0] + m[1, 1] + m[2, 2]],
    ])  # fmt: skip
    return np.linalg.eigh(k / 3)[1][:, -1]


def header(t, frame):
    return {"stamp": {"sec": int(t), "nanosec": int(round((t % 1) * 1e9))}, "frame_id": frame}


def main(folder):
    random = np.random.default_rng(20261128)
    arm = Arm(random)
    at_rest = random.uniform(-1.2, 1.2, (POSES, 6)) + np.array([0, -1.2, 1.2, -1, -1.5, 0])
    length = POSES * (MOVE + REST)

    def joints(t):
        k = np.clip((t // (MOVE + REST)).astype(int), 0, POSES - 1)
        s = np.clip((t - k * (MOVE + REST)) / MOVE, 0, 1)
        before = np.vstack([at_rest[0], at_rest])[k]
        return before + (at_rest[k] - before) * (s * s * (3 - 2 * s))[:, None]

    messages = []
    times = np.arange(0, length, 1 / JOINT_RATE)
    for t, q in zip(times, joints(times), strict=True):
        state = {"header": header(BEGIN + t, ""), "name": [*NAMES, "gripper"], "position": [*np.round(q[ORDER], 6), 0.01], "velocity": [], "effort": []}
        messages.append((BEGIN + t + 0.002, "/joint_states", "sensor_msgs/msg/JointState", state))
    times = np.arange(0.03, length - 0.2, 1 / SEEN_RATE)
    for t, q in zip(times, joints(times), strict=True):
        pose = arm.pose(q)
        stamp = BEGIN + t + DELAY
        points = (pose[:3, :3] @ TOOLS.T).T + pose[:3, 3] + random.normal(0, 15e-6, (2, 3))
        xyz = [dict(zip("xyz", p, strict=True)) for p in points]
        turn = dict(zip("xyzw", quaternion(pose[:3, :3]), strict=True))
        messages.append((stamp + 0.003, "/tracker", "geometry_msgs/msg/PointStamped", {"header": header(stamp, "tracker"), "point": xyz[0]}))
        messages.append((stamp + 0.003, "/board", "geometry_msgs/msg/PoseStamped", {"header": header(stamp, "camera"), "pose": {"position": xyz[0], "orientation": turn}}))
        frames = [
            {"header": header(stamp, "base_link"), "child_frame_id": "shoulder_link", "transform": {"translation": dict(x=0.0, y=0.0, z=0.089), "rotation": turn}},
            {"header": header(stamp, "camera"), "child_frame_id": "tag_4", "transform": {"translation": xyz[1], "rotation": turn}},
        ]
        messages.append((stamp + 0.003, "/tf", "tf2_msgs/msg/TFMessage", {"transforms": frames}))
    messages.sort(key=lambda m: m[0])

    rosbags(folder / "tracker", messages, {"/joint_states", "/tracker"}, StoragePlugin.SQLITE3, CompressionMode.FILE)
    rosbags(folder / "frames", messages, {"/joint_states", "/tf"}, StoragePlugin.MCAP, CompressionMode.STORAGE)
    by_foxglove(folder / "board.mcap", messages, {"/joint_states", "/board"})
    with (folder / "truth.csv").open("w") as truth:
        truth.write("begin_s," + ",".join(f"q{k + 1}_deg" for k in range(6)) + ",x_mm,y_mm,z_mm\n")
        for k, q in enumerate(at_rest):
            x, y, z = (arm.pose(q) @ [*TOOLS[0], 1])[:3] * 1e3
            truth.write(f"{k * (MOVE + REST) + MOVE:.3f}," + ",".join(f"{v:.6f}" for v in np.degrees(q)) + f",{x:.5f},{y:.5f},{z:.5f}\n")


def rosbags(path, messages, topics, storage, mode):
    store = get_typestore(Stores.ROS2_HUMBLE)

    def built(name, value):
        fields = dict(store.get_msgdef(name).fields)
        return store.types[name](**{key: of(fields[key], part) for key, part in value.items()})

    def of(field, value):
        kind, detail = field
        if kind.name == "NAME":
            return built(detail, value)
        if kind.name == "BASE":
            return value
        (inner, name), _ = detail
        if inner.name == "NAME":
            return [built(name, part) for part in value]
        return value if name[0] == "string" else np.array(value, dtype=np.float64)

    bag = Writer(path, version=8, storage_plugin=storage)
    bag.set_compression(mode, CompressionFormat.ZSTD)
    with bag:
        known = {}
        for t, topic, name, value in messages:
            if topic in topics:
                if topic not in known:
                    known[topic] = bag.add_connection(topic, name, typestore=store)
                bag.write(known[topic], int(t * 1e9), store.serialize_cdr(built(name, value), name))


def by_foxglove(path, messages, topics):
    store = get_typestore(Stores.ROS2_HUMBLE)
    with path.open("wb") as file:
        writer = McapWriter(file, compression=CompressionType.LZ4)
        schemas = {}
        for t, topic, name, value in messages:
            if topic in topics:
                if name not in schemas:
                    schemas[name] = writer.register_msgdef(name, store.generate_msgdef(name, ros_version=2)[0])
                writer.write_message(topic, schemas[name], value, log_time=int(t * 1e9), publish_time=int(t * 1e9))
        writer.finish()


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
