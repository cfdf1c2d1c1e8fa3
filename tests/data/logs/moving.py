"""Makes the recordings of a moving arm in `moving`, and what is true of them: moving.py [FOLDER].

The UR5 of `make.py` swings all its joints for a minute; its driver states them 125 times a second, and a tracker with a clock of its own sees a point of the flange 100
times a second, 8 ms late by its filter. Stamps jitter by 0.2 ms, and two readings in a hundred are lost. The kinematics are standard DH in numpy.
"""

import sys
from pathlib import Path

import numpy as np

A = [0, -0.425, -0.39225, 0, 0, 0]
D = [0.089159, 0, 0, 0.10915, 0.09465, 0.0823]
ALPHA = [np.pi / 2, 0, 0, np.pi / 2, -np.pi / 2, 0]
WORLD = np.array([[0.8, -0.6, 0, 1.5], [0.6, 0.8, 0, -0.7], [0, 0, 1, 0.4], [0, 0, 0, 1.0]])
TOOL = np.array([0.03, -0.02, 0.11, 1])
MIDDLE, REACH = np.array([0, -1.2, 1.2, -1, -1.5, 0]), np.array([1.2, 0.4, 0.5, 1.2, 0.9, 1.5])
SLOW = np.array([0.062, 0.086, 0.106, 0.122, 0.142, 0.166])
SECONDS, JOINT_RATE, SEEN_RATE, FILTER, CLOCK, STEP = 60.0, 125.0, 100.0, 0.008, 37.5, 2e-4
NOISE, JITTER, LOST = 20e-6, 2e-4, 0.02


class Arm:
    def __init__(self, random):
        self.theta, self.alpha = random.normal(0, np.radians(0.15), 6), random.normal(0, np.radians(0.05), 6)
        self.a, self.d = random.normal(0, 4e-4, 6), random.normal(0, 4e-4, 6)

    def points(self, q):
        """World positions of the tool at rows of joints."""
        pose = np.broadcast_to(WORLD, (len(q), 4, 4))
        for i in range(6):
            s, c = np.sin(q[:, i] + self.theta[i]), np.cos(q[:, i] + self.theta[i])
            sa, ca = np.sin(ALPHA[i] + self.alpha[i]), np.cos(ALPHA[i] + self.alpha[i])
            a, d = A[i] + self.a[i], D[i] + self.d[i]
            z, one = np.zeros_like(s), np.ones_like(s)
            link = np.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [z, sa * one, ca * one, d * one], [z, z, z, one]])
            pose = pose @ link.transpose(2, 0, 1)
        return (pose @ TOOL)[:, :3]


def main(folder):
    random = np.random.default_rng(20261129)
    arm = Arm(random)
    phases = random.uniform(0, 2 * np.pi, (2, 6))

    def joints(t):
        first = 0.7 * np.sin(2 * np.pi * SLOW * t[:, None] + phases[0])
        return MIDDLE + REACH * (first + 0.3 * np.sin(2 * np.pi * 2.3 * SLOW * t[:, None] + phases[1]))

    def stamps(rate):
        times = np.arange(0, SECONDS, 1 / rate)
        times = times[random.uniform(size=len(times)) > LOST]
        return times, times + random.normal(0, JITTER, len(times))

    # A filter of first order follows by small steps, exactly between two of them where the point moves evenly.
    fine = np.arange(0, SECONDS, STEP)
    true, keep = arm.points(joints(fine)), np.exp(-STEP / FILTER)
    behind, now = np.empty_like(true), true[0]
    slope = 1 - (1 - keep) * FILTER / STEP
    for k in range(len(fine)):
        if k:
            now = keep * now + (1 - keep) * true[k - 1] + slope * (true[k] - true[k - 1])
        behind[k] = now
    folder.mkdir(parents=True, exist_ok=True)
    times, stated = stamps(JOINT_RATE)
    np.savetxt(folder / "joints.csv", np.column_stack([stated, joints(times)]), "%.6f", ",", header="time_s,q1_rad,q2_rad,q3_rad,q4_rad,q5_rad,q6_rad", comments="")
    times, stated = stamps(SEEN_RATE)
    seen = np.column_stack([np.interp(times, fine, behind[:, c]) for c in range(3)]) + random.normal(0, NOISE, (len(times), 3))
    np.savetxt(folder / "tracker.csv", np.column_stack([stated + CLOCK, seen * 1e3]), ["%.6f", "%.4f", "%.4f", "%.4f"], ",", header="time_s,x_mm,y_mm,z_mm", comments="")
    at = joints(random.uniform(0, 1000, 200))
    rows = np.column_stack([np.degrees(at), arm.points(at) * 1e3])
    np.savetxt(folder / "truth.csv", rows, "%.5f", ",", header="q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm", comments="")


main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "moving")
