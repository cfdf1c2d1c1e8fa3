"""pybotics 3.1.2: every parameter of its modified Denavit-Hartenberg chain, with base and tool, by least squares of its forward kinematics.

Its own example minimises the distances of measured and predicted points. Their components are taken instead, which is the same minimum and
converges. Its rows have no beta, so axes that are nearly parallel have no good row; one tool is fitted, the others are placed on it.
"""

import sys

import numpy as np
from division import Arm, Array, Division, Seat, main_tool, nominal_arm, read, write
from pybotics.geometry import matrix_2_vector, vector_2_matrix
from pybotics.optimization import OptimizationHandler
from pybotics.robot import Robot
from pybotics.tool import Tool
from scipy.optimize import least_squares

#: A skew below this is rounding, rad.
NO_BETA = 1e-6


def calibrated(division: Division) -> Arm:
    """The arm of pybotics, identified from the rows of one tool."""
    links = division.links
    if any(abs(link["beta"]) > NO_BETA for link in links):
        sys.exit("pybotics has no row with a beta, which this robot needs")
    rows = main_tool(division.fitted)
    seat = Seat(nominal_arm(division), rows)
    rotation, shift = next(iter(seat.base.values()))
    base, tool = np.eye(4), np.eye(4)
    base[:3, :3], base[:3, 3], tool[:3, 3] = rotation, shift, seat.tools[rows.tool[0]]
    chain = np.array([[link["alpha"], link["a"], link["theta"], link["d"]] for link in links])
    robot = Robot.from_parameters(chain.ravel())
    robot.tool, robot.world_frame = Tool(matrix=tool), vector_2_matrix(matrix_2_vector(base))
    handler = OptimizationHandler(
        robot=robot, kinematic_chain_mask=True, tool_mask=[True] * 3 + [False] * 3, world_mask=True
    )

    def left(vector: Array) -> Array:
        handler.apply_optimization_vector(vector)
        return np.concatenate([handler.robot.fk(q)[:3, 3] for q in rows.joints]) - rows.measured.ravel()

    start = handler.generate_optimization_vector()
    # Lengths are in mm and angles in rad: steps are scaled by what they do.
    found = least_squares(left, start, x_scale="jac", method="trf", max_nfev=30)
    handler.apply_optimization_vector(found.x)
    handler.robot.tool, handler.robot.world_frame = Tool(), np.eye(4)
    return lambda joints: np.array([handler.robot.fk(q) for q in joints])


division = read()
write(division, Seat(calibrated(division), division.fitted).predict(division.judged))
