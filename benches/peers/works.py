"""The works: their arm, their inputs, and what a peer must find before it is timed."""

import csv
import json
import lzma
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

#: Inputs and reference numbers.
GOLDEN = Path(__file__).resolve().parents[2] / "tests/data/golden"


def text(name: str) -> str:
    """A file of them; the large ones are packed."""
    packed = GOLDEN / f"{name}.xz"
    return lzma.decompress(packed.read_bytes()).decode() if packed.is_file() else (GOLDEN / name).read_text()


def golden(name: str) -> dict:
    """Reference numbers of independent programs."""
    return json.loads(text(name))


def table(name: str) -> np.ndarray:
    """Rows of an input."""
    return np.array([[float(x) for x in row] for row in list(csv.reader(text(f"inputs/{name}").splitlines()))[1:]])


MODEL = golden("model.json")
#: The drawing's values of the 31 parameters, SI:
#: base x y z rz ry rx | alpha_1..5 | a_1..5 | d_3..6 | theta_2..6 | beta_2 | c_2..6.
NOMINAL = np.array([p["nominal_si"] for p in MODEL["params"]])
#: What is not among the 31: alpha_0 (rad), d_1 (m).
ALPHA_0 = np.radians(MODEL["mdh_nominal"][0]["alpha_prev_deg"])
D_1 = MODEL["mdh_nominal"][0]["d_mm"] / 1e3
#: The tool in frame 6: xyz (m), then rz ry rx (rad).
TOOL = np.concatenate([np.divide(MODEL["tool"]["xyz_mm"], 1e3), np.radians(MODEL["tool"]["alpha_beta_gamma_deg"])])
#: Fall, m/s2, along -z of the world.
GRAVITY = -MODEL["gravity_world_m_s2"][2]
#: Mass that each link carries (kg), and its first moment in the link's frame (kg m); the last link carries the gauge.
MASS, MOMENT = np.zeros(6), np.zeros((6, 3))
for link in MODEL["inertial"]["links"]:
    MASS[link["frame"] - 1] += link["mass_kg"]
    MOMENT[link["frame"] - 1] += link["mass_kg"] * np.array(link["com_m"])
#: Centres of the balls in the world, m.
BALLS = np.divide(MODEL["balls_world_mm"], 1e3)
#: Lower and upper limit of each joint, rad.
LIMITS = np.radians(MODEL["joint_limits_deg"]).T
#: Radii of ball and plunger's disk, m.
BALL, DISK = MODEL["tricals"]["datum_ball_radius_mm"] / 1e3, MODEL["tricals"]["tip_disk_radius_mm"] / 1e3
#: W4: one-sigma of each joint after each motion (rad) and of each reading (m), when a ball is centred (m), readings at most.
JOINT_NOISE, READING_NOISE, CENTRED, MOST_READINGS = 1e-6, 0.6e-6, 3e-6, 12


def random_configurations(count: int) -> np.ndarray:
    """Configurations inside the joint limits (W1, W5), one a row."""
    return np.random.default_rng(1).uniform(*LIMITS, (count, 6))


def random_centres(count: int) -> np.ndarray:
    """Ball centres up to 6 mm off the gauge's along each axis (W6), one a row, m."""
    return np.random.default_rng(1).uniform(-6e-3, 6e-3, (count, 3))


def ball_poses(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Ball centres (m) and joints (rad) of `w2_measured.csv`, `w2_selection.csv` or `w3_pool.csv`, one pose a row."""
    rows = table(name)
    return BALLS[rows[:, -7].astype(int)], rows[:, -6:].copy()


@dataclass(frozen=True)
class Peer:
    """A program that does a work: its name, the units of work that one run does, and the run."""

    work: str
    name: str
    units: int
    run: Callable[[], object]


def expect(name: str, found: np.ndarray, wanted: np.ndarray, within: float) -> None:
    """Ends the run unless a peer found what is wanted: a wrong peer is no peer."""
    worst = np.abs(np.asarray(found) - wanted).max()
    if not worst < within:
        raise SystemExit(f"{name} is off by {worst:.3g}, allowed {within:.3g}")


#: As in `benches/works`: poses (m), columns (m per SI unit), torques (N m) of the golden configurations are kept to 1e-12.
KINEMATICS_TOLERANCE = 1e-11


def golden_configurations() -> np.ndarray:
    """The 200 configurations with reference numbers, one a row, rad."""
    return np.array(golden("fk_torque_200.json")["q"])


def expect_torques(name: str, found: np.ndarray) -> None:
    """Holding torques (200 x 6) of the golden configurations."""
    expect(name, found, np.array(golden("fk_torque_200.json")["tau_pinocchio"]), KINEMATICS_TOLERANCE)


def expect_kinematics(name: str, tcp: np.ndarray, columns: np.ndarray, torques: np.ndarray) -> None:
    """Positions (200 x 3), columns (200 x 3 x 31) and holding torques (200 x 6) of the golden configurations."""
    poses = np.array(golden("fk_torque_200.json")["pose_nominal_pinocchio"]).reshape(-1, 4, 4)
    # The columns are those of the first configurations.
    jacobians = np.array(golden("jac31_64.json")["nominal"]["J"]).reshape(-1, 3, 31)
    expect(f"{name}: position", tcp, poses[:, :3, 3], KINEMATICS_TOLERANCE)
    expect(f"{name}: columns", columns[: len(jacobians)], jacobians, KINEMATICS_TOLERANCE)
    expect_torques(f"{name}: torques", torques)


def expect_readings(name: str, read: Callable[[np.ndarray], np.ndarray], within: float = 1e-15) -> None:
    """Readings (m) of the golden ball centres, one a row; they are of millimetres, kept to 1e-16 m."""
    contact = golden("contact_500.json")
    expect(f"{name}: readings", read(np.array(contact["centres_m"])), np.array(contact["reading_analytic_m"]), within)


def expect_identification(name: str, parameters: np.ndarray) -> None:
    """Parameters of W2, SI; the reference is converged to rounding."""
    expect(name, parameters, np.array(golden("identify_w2.json")["rho"]), 1e-9)


def expect_selection(name: str, jacobian: np.ndarray, chosen: np.ndarray) -> None:
    """O1 = (prod sigma)^(1/31) / sqrt(80), SI, of 80 distinct candidates (each 3 x 31).

    A start ends at a local optimum: it may be 0.15 % below the best of ten starts of an independent program.
    """
    if len(set(chosen)) != 80:
        raise SystemExit(f"{name} chose {len(set(chosen))} candidates, not 80")
    o1 = np.exp(np.log(np.linalg.svd(jacobian[chosen].reshape(240, 31), compute_uv=False)).mean()) / np.sqrt(80)
    print(f"{name}: O1 {o1:.5f}", file=sys.stderr)
    expect(name, np.minimum(o1, best := golden("o1_w3.json")["o1_selection"]), best, 0.0015 * best)


def expect_trials(name: str, outcomes: np.ndarray) -> None:
    """Mean and largest error, residual rms (m), readings a centring of trials of W4: averages of an independent program.

    Both sides draw their own noise: 4.5 standard errors of the difference are allowed, and the reference's rounding.
    """
    wanted, rounding = np.array([1.090e-6, 2.547e-6, 0.807e-6, 2.984]), np.array([0.5e-9, 0.5e-9, 0.5e-9, 0.5e-3])
    error = outcomes.std(axis=0, ddof=1) * np.sqrt(1 / len(outcomes) + 1 / 1000)
    expect(
        f"{name}: averages in units of what is allowed", (outcomes.mean(axis=0) - wanted) / (4.5 * error + rounding), 0.0, 1.0
    )
