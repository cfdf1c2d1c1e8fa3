"""Writes table.csv and table.xlsx: joints of a nominal UR5 and positions of a target on its flange, disturbed by 0.3 mm; and hand_eye.csv: a UR5 with errors of
its joints and lengths, whose camera sees a board, by joints and by the poses of the flange that its controller states.

    python -m pip install numpy openpyxl
    python tests/data/tables/make.py
"""

import csv
from pathlib import Path

import numpy
from openpyxl import Workbook

ROWS = 40
# alpha (quarter turns), a, d of the manufacturer's distal table, m.
TABLE = [(1, 0.0, 0.089159), (0, -0.425, 0.0), (0, -0.39225, 0.0), (1, 0.0, 0.10915), (-1, 0.0, 0.09465), (0, 0.0, 0.0823)]


def transform(alpha, a, d, theta):
    c, s = numpy.cos(theta), numpy.sin(theta)
    ca, sa = [1, 0, -1][abs(alpha)], [0, 1, 0][abs(alpha)] * numpy.sign(alpha)
    return numpy.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]])


def arm(q, zeros, lengths):
    """Pose of the flange in the base; the errors of the joints in rad and of the lengths in m."""
    pose = numpy.eye(4)
    for (alpha, a, d), theta, zero, longer in zip(TABLE, q, zeros, lengths):
        pose = pose @ transform(alpha, a + longer, d, theta + zero)
    return pose


def turned(vector):
    """The rotation by a rotation vector (Rodrigues)."""
    angle = numpy.linalg.norm(vector)
    x, y, z = vector / angle if angle > 0 else vector
    cross = numpy.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return numpy.eye(3) + numpy.sin(angle) * cross + (1 - numpy.cos(angle)) * cross @ cross


def frame(vector, place):
    pose = numpy.eye(4)
    pose[:3, :3], pose[:3, 3] = turned(numpy.array(vector)), place
    return pose


def rotation_vector(rotation):
    """For angles below a half turn."""
    angle = numpy.arccos((numpy.trace(rotation) - 1) / 2)
    return numpy.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]) * angle / (2 * numpy.sin(angle))


def quaternion(rotation):
    """x, y, z, w."""
    vector = rotation_vector(rotation)
    angle = numpy.linalg.norm(vector)
    return [*(vector / angle * numpy.sin(angle / 2)), numpy.cos(angle / 2)]


def hand_eye(folder):
    """A camera on the hand sees the board to 0.2 mm and 0.03 deg."""
    random = numpy.random.default_rng(11)
    zeros, lengths = numpy.radians(random.normal(0.0, 0.15, 6)), random.normal(0.0, 3e-4, 6)
    # The board stands 0.6 m before the robot; the camera looks along the axis of the flange, or nearly.
    board = frame([0.1, -0.2, 1.2], [-0.65, -0.15, 0.02])
    camera = frame([0.05, -0.03, 0.4], [0.01, -0.06, 0.05])
    middle, span = numpy.radians([-10, -95, 105, -100, -90, 20]), numpy.radians([25, 15, 15, 35, 35, 70])
    rows = []
    for k in range(60):
        q = numpy.round(middle + span * random.uniform(-1, 1, 6), 6)
        seen = numpy.linalg.inv(arm(q, zeros, lengths) @ camera) @ board
        place = seen[:3, 3] * 1e3 + random.normal(0.0, 0.2, 3)
        rotation = turned(numpy.radians(random.normal(0.0, 0.03, 3))) @ seen[:3, :3]
        said = arm(q, numpy.zeros(6), numpy.zeros(6))
        rows.append([q, said[:3, 3] * 1e3, rotation_vector(said[:3, :3]), place, quaternion(rotation)])
    board_titles = ["board_x_mm", "board_y_mm", "board_z_mm", "board_qx", "board_qy", "board_qz", "board_qw"]
    joints = [f"joint_{i}_rad" for i in range(1, 7)]
    flange = ["x_mm", "y_mm", "z_mm", "rx_rad", "ry_rad", "rz_rad"]
    text = lambda *parts: [f"{v:.6f}" for part in parts for v in part]
    for name, titles, chosen in [("hand_eye.csv", joints, lambda r: text(r[0])), ("hand_eye_flange.csv", flange, lambda r: text(r[1], r[2]))]:
        with open(folder / name, "w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows([titles + board_titles, *(chosen(r) + text(r[3], r[4]) for r in rows)])
    print("truth: zeros, deg", numpy.degrees(zeros), "camera in the flange", camera, "base in the board", numpy.linalg.inv(board), sep="\n")


def main():
    hand_eye(Path(__file__).parent)
    random = numpy.random.default_rng(5)
    rows = []
    for k in range(ROWS):
        q = numpy.radians(random.uniform(-120, 120, 6))
        pose = numpy.eye(4)
        for (alpha, a, d), theta in zip(TABLE, q):
            pose = pose @ transform(alpha, a, d, theta)
        point = (pose @ [0.02, 0.01, 0.1, 1.0])[:3] * 1e3 + [1500.0, -300.0, 250.0] + random.normal(0.0, 0.3, 3)
        rows.append([f"p{k + 1}", *(round(float(v), 6) for v in q), *(round(float(v), 4) for v in point)])
    titles = ["point", *(f"q_{i}" for i in range(6)), "x [mm]", "y [mm]", "z [mm]"]
    here = Path(__file__).parent
    with open(here / "table.csv", "w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([titles, *rows])
    book = Workbook()
    book.active.title = "Remarks"
    book.active["A1"] = "measured by night"
    sheet = book.create_sheet("Measurements")
    for line, row in enumerate([titles, *rows]):
        for column, value in enumerate(row):
            # The table begins in B4.
            sheet.cell(line + 4, column + 2, value)
    book.save(here / "table.xlsx")


if __name__ == "__main__":
    main()
