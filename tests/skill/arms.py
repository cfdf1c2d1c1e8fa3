"""Simulated measurements of arms that differ from their nominal dimensions, by the standard library alone."""

import math
import random

Matrix = list[list[float]]

# alpha (deg), a (mm), theta (deg), d (mm) of modified Denavit-Hartenberg rows, as `calibench robots` prints them.
KR6 = [(180, 0, 0, -400), (90, 25, 0, 0), (0, 315, -90, 0), (90, 35, 0, -365), (-90, 0, 0, 0), (90, 0, 0, -80)]
UR5 = [(0, 0, 0, 89.159), (90, 0, 0, 0), (0, -425, 0, 0), (0, -392.25, 0, 109.15), (90, 0, 0, 94.65), (-90, 0, 0, 82.3)]
UR10 = [(0, 0, 0, 127.3), (90, 0, 0, 0), (0, -612, 0, 0), (0, -572.3, 0, 163.941), (90, 0, 0, 115.7), (-90, 0, 0, 92.2)]
# Of the limits of that KR 6, deg; the others have a turn either way.
KR6_RANGES = [(-119, 119), (-133, 31), (-84, 109), (-129, 129), (-84, 84), (-245, 245)]
UR_RANGES = [(-115, 115)] * 6


def times(a: Matrix, b: Matrix) -> Matrix:
    return [[sum(a[i][k] * b[k][j] for k in range(4)) for j in range(4)] for i in range(4)]


def chain(*parts: Matrix) -> Matrix:
    product = parts[0]
    for part in parts[1:]:
        product = times(product, part)
    return product


def shift(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Matrix:
    return [[1, 0, 0, x], [0, 1, 0, y], [0, 0, 1, z], [0, 0, 0, 1]]


def turn(axis: str, angle: float) -> Matrix:
    """About an axis, rad."""
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    made = shift()
    made[i][i] = made[j][j] = math.cos(angle)
    made[i][j], made[j][i] = -math.sin(angle), math.sin(angle)
    return made


def position(pose: Matrix) -> list[float]:
    return [pose[i][3] for i in range(3)]


def quaternion(m: Matrix) -> list[float]:
    """Real part first. By the largest of the four, so that no small number is divided by."""
    squares = [m[0][0] + m[1][1] + m[2][2], m[0][0] - m[1][1] - m[2][2], m[1][1] - m[0][0] - m[2][2], m[2][2] - m[0][0] - m[1][1]]
    largest = max(range(4), key=squares.__getitem__)
    rows = [
        [1 + squares[0], m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]],
        [m[2][1] - m[1][2], 1 + squares[1], m[0][1] + m[1][0], m[0][2] + m[2][0]],
        [m[0][2] - m[2][0], m[0][1] + m[1][0], 1 + squares[2], m[1][2] + m[2][1]],
        [m[1][0] - m[0][1], m[0][2] + m[2][0], m[1][2] + m[2][1], 1 + squares[3]],
    ]
    length = 2 * math.sqrt(1 + squares[largest])
    return [value / length for value in rows[largest]]


class Arm:
    """An arm with errors of 0.3 mm and 0.05 deg, one-sigma, in every row, on a base of its own."""

    def __init__(self, rows, ranges, tool: Matrix, seed: int) -> None:
        self.random = random.Random(seed)
        self.ranges = ranges
        self.tool = tool
        self.base = chain(shift(1200, -340, 150), turn("z", 0.7), turn("y", 0.02))
        angle = math.radians(0.05)
        self.rows = [
            (
                math.radians(alpha) + self.random.gauss(0, angle),
                a + self.random.gauss(0, 0.3),
                math.radians(theta) + self.random.gauss(0, angle),
                d + self.random.gauss(0, 0.3),
            )
            for alpha, a, theta, d in rows
        ]

    def joints(self) -> list[float]:
        """A posture, deg."""
        return [round(self.random.uniform(*limits), 5) for limits in self.ranges]

    def pose(self, joints: list[float], lost: dict[int, float] | None = None) -> Matrix:
        """Where the tool is; with the zeros that joints have lost, deg."""
        made = self.base
        for index, ((alpha, a, theta, d), joint) in enumerate(zip(self.rows, joints, strict=True), start=1):
            q = theta + math.radians(joint + (lost or {}).get(index, 0.0))
            made = chain(made, turn("x", alpha), shift(a), turn("z", q), shift(z=d))
        return times(made, self.tool)

    def noisy(self, values: list[float], sigma: float) -> list[float]:
        return [round(value + self.random.gauss(0, sigma), 5) for value in values]
