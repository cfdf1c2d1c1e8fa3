"""robotkinecal 0.1.0: the screw axes of the joints, from positions alone, as its `SerialRobotKineCal` identifies them.

It knows one tool: its axes are identified from the rows of that with most of them, and the others are placed on the arm so found.
"""

import numpy as np
import roboticstoolbox as rtb
from division import Arm, Array, Division, Seat, main_tool, nominal_arm, read, write
from robotkinecal import SerialRobotKineCal
from spatialmath import SE3, Twist3

#: Its unit of length here, mm; in metres its steps diverge more often.
MM_PER_UNIT = 1.0
#: Its own loop ends after the step that made the errors larger, and keeps it. Here it goes step by step, and the axes with the least errors stay.
ROUNDS = 30
#: Gain of a step, over the errors, below which the next is not tried.
CONVERGED = 1e-4


def drawn(division: Division, tool: Array) -> rtb.Robot:
    """The nominal robot for the Robotics Toolbox, in mm, with a point of the tool, mm, as its last link."""
    links: list[rtb.Link] = []
    for k, link in enumerate(division.links):
        # A turn about z commutes with a shift along it, so that the joint comes last.
        ets = (
            rtb.ET.Rx(link["alpha"])
            * rtb.ET.tx(link["a"] / MM_PER_UNIT)
            * rtb.ET.Ry(link["beta"])
            * rtb.ET.tz(link["d"] / MM_PER_UNIT)
            * rtb.ET.Rz(link["theta"])
            * rtb.ET.Rz()
        )
        links.append(rtb.Link(ets, name=f"link{k + 1}", parent=links[-1] if links else None))
    x, y, z = tool / MM_PER_UNIT
    links.append(rtb.Link(rtb.ET.tx(x) * rtb.ET.ty(y) * rtb.ET.tz(z), name="tip", parent=links[-1]))
    return rtb.Robot(links, name="drawn")


def calibrated(division: Division) -> Arm:
    """The arm of robotkinecal: the product of the exponentials of its screw axes."""
    np.random.seed(1)  # it draws a vector for every axis
    rows = main_tool(division.fitted)
    nominal = nominal_arm(division)
    seat = Seat(nominal, rows)
    rotation, shift = next(iter(seat.base.values()))
    solver = SerialRobotKineCal(drawn(division, seat.tools[rows.tool[0]]), ee_name="tip")
    # Measured points in the frame of the nominal base: its axes have to begin near where they are.
    points = (rows.measured - shift) @ rotation / MM_PER_UNIT
    solver.set_observations(list(rows.joints), list(points))
    axes, least = [], np.inf
    for _ in range(ROUNDS):
        before = [np.array(axis) for axis in solver.joint_screw_axis]
        # The errors that a round states are those before its step.
        error = float(np.linalg.norm(solver.solve(max_iterations=1).iteration_results[0].position_errors))
        converged = error > least * (1.0 - CONVERGED)
        if error < least:
            axes, least = before, error
        if converged:
            break
    zero = nominal(np.zeros((1, len(axes))))[0]

    def poses(joints: Array) -> Array:
        found = np.empty((len(joints), 4, 4))
        for k, q in enumerate(joints):
            pose = SE3()
            for axis, angle in zip(axes, q, strict=True):
                pose = pose * Twist3(axis).exp(angle)
            found[k] = pose.A @ zero
        return found

    return poses


division = read()
write(division, Seat(calibrated(division), division.fitted).predict(division.judged))
