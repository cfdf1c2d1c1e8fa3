"""ur_rtde drives a served Universal Robot: it reads the arm, asks the dashboard, and moves the arm by its own control program.

    they_drive_the_served_robot.py PROGRAM SCENARIO

What it needs is made by `tests/clients/run`. Ends with 1 and says why when it is not so. The ports are those of a real controller:
the client knows no others.
"""

import json
import signal
import subprocess
import sys
import time

from dashboard_client import DashboardClient
from rtde_control import RTDEControlInterface
from rtde_receive import RTDEReceiveInterface

HOST = "127.0.0.1"
ABOVE_THE_TABLE = [0.0, -1.6, -1.2, -1.9, 1.57, 0.0]
# Ten arc seconds: what the servos leave.
AS_COMMANDED = 5e-5


def expect(is_so, what):
    if not is_so:
        sys.exit(f"not so: {what}")


def apart(a, b):
    return max(abs(x - y) for x, y in zip(a, b))


def expect_soon(is_so, what):
    """What arrives on the other connection may be a little behind; on a busy machine more than a little."""
    began = time.monotonic()
    while not is_so() and time.monotonic() - began < 20.0:
        time.sleep(0.01)
    expect(is_so(), what())


def main(program, scenario):
    command = [program, "sim", "serve", scenario, "--robot", "ur", "--robot-port", "30004", "--time-scale", "20"]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    expect(json.loads(process.stdout.readline())["robot"] == f"{HOST}:30004", "the port of RTDE")

    arm = RTDEReceiveInterface(HOST)
    expect(arm.getRobotMode() == 7 and arm.getSafetyMode() == 1, "it runs, and nothing is stopped")
    dashboard = DashboardClient(HOST)
    dashboard.connect()
    expect(dashboard.robotmode() == "Robotmode: RUNNING", dashboard.robotmode())
    expect(dashboard.isInRemoteControl() and not dashboard.running(), "remote control, and no program")

    robot = RTDEControlInterface(HOST)
    expect(dashboard.running(), "its control program")
    expect(robot.moveJ(ABOVE_THE_TABLE, 1.05, 1.4), "moveJ")
    expect_soon(lambda: apart(arm.getActualQ(), ABOVE_THE_TABLE) < AS_COMMANDED, lambda: f"joints {arm.getActualQ()}")
    target = arm.getTargetTCPPose() if hasattr(arm, "getTargetTCPPose") else arm.getActualTCPPose()
    target[2] += 0.02
    expect(robot.moveL(target, 0.25, 1.2), "moveL")
    # A servo's residual at the length of the arm, m.
    expect_soon(lambda: apart(arm.getActualTCPPose()[:3], target[:3]) < 1e-4, lambda: f"tool {arm.getActualTCPPose()}")
    expect(robot.setTcp([0.0, 0.0, 0.1, 0.0, 0.0, 0.0]), "setTcp")
    expect(apart(robot.getTCPOffset(), [0.0, 0.0, 0.1, 0.0, 0.0, 0.0]) < 1e-9, "the tool comes back")
    expect(not robot.isJointsWithinSafetyLimits([7.0] * 6), "joints beyond their limits")
    expect(robot.setPayload(2.5, [0.0, 0.0, 0.05]), "setPayload")
    expect_soon(lambda: abs(arm.getPayload() - 2.5) < 1e-9, lambda: f"payload {arm.getPayload()}")
    robot.stopScript()
    robot.disconnect()
    arm.disconnect()

    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=20)
    expect(process.returncode == 0 and said.startswith("indicators: "), said)
    print("ur_rtde drives the served robot")


if __name__ == "__main__":
    main(*sys.argv[1:])
