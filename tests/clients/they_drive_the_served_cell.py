"""py_openshowvar and pyserial drive a served cell: they read, write, move the arm, and master an indicator.

    they_drive_the_served_cell.py PROGRAM SCENARIO

What it needs is made by `tests/clients/run`. Ends with 1 and says why when it is not so.
"""

import json
import re
import signal
import subprocess
import sys
import time

import serial
from py_openshowvar import openshowvar


def expect(is_so, what):
    if not is_so:
        sys.exit(f"not so: {what}")


class Served:
    """A served cell; nothing in it takes time."""

    def __init__(self, program, scenario, *switches):
        command = [program, "sim", "serve", scenario, "--time-scale", "0", "--commands", *switches]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        addresses = json.loads(self.process.stdout.readline())
        self.indicators = addresses["indicators"]
        self.robot = (addresses["robot"].split(":")[0], int(addresses["robot"].split(":")[1]))

    def tell(self, command):
        self.process.stdin.write(command + "\n")
        self.process.stdin.flush()
        expect(self.process.stdout.readline() == "ok\n", command)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGINT)
        _, said = self.process.communicate(timeout=20)
        expect(self.process.returncode == 0 and said.startswith("indicators: "), said)


def robot(program, scenario):
    with Served(program, scenario, "--program", "plain") as served:
        client = openshowvar(*served.robot)
        expect(client.can_connect, "a second connection")
        read = lambda name: client.read(name, debug=False)
        write = lambda name, value: client.write(name, value, debug=False)
        expect(read("$OV_PRO") == b"100", "$OV_PRO")
        expect(write("$OV_PRO", "50") == b"50" and read("$OV_PRO") == b"50", "$OV_PRO = 50")
        expect(read("$NOBODY") == b"", "a variable that there is not")
        expect(write("$MODE_OP", "#T1") is None, "a variable that cannot be written")
        expect(write("COM_E6AXIS", "{E6AXIS: A1 12.5, A2 -90, A3 90, A4 0, A5 30, A6 0}") is not None, "COM_E6AXIS")
        write("COM_ACTION", "2")
        while read("COM_ACTION") != b"0":
            time.sleep(0.001)
        expect(read("$AXIS_ACT").startswith(b"{E6AXIS: A1 12.5, A2 -90.0, A3 90.0, A4 0.0, A5 30.0, A6 0.0, E1 0.0"), "$AXIS_ACT")
        measured = float(read("$AXIS_ACT_MEAS.A1"))
        # Ten arc seconds: what the servos leave.
        expect(abs(measured - 12.5) < 10 / 3600, f"$AXIS_ACT_MEAS.A1 = {measured}")
        position = re.fullmatch(rb"\{E6POS: X (\S+), .*, S 2, T 2, E1 0\.0, .*E6 0\.0\}", read("$POS_ACT"))
        expect(position is not None, "$POS_ACT")
        expect(len(read("$POS_ACT")) <= 246, "an answer fits in one read")
        client.close()


def indicators(program, scenario):
    with Served(program, scenario) as served:
        ports = [serial.Serial(path, 4800, bytesize=8, parity="N", stopbits=1, timeout=2) for path in served.indicators]

        def ask(port, request):
            port.write(request + b"\r")
            return port.read_until(b"\r")

        for port in ports:
            expect(ask(port, b"ID?") == b"SY289\r", "ID?")
            expect(ask(port, b"PRE +6.350") == b"PRE+6.350\r" and ask(port, b"PRE") == b"PRE\r", "mastering")
            value = float(ask(port, b"?"))
            # Two of the last digit: noise of 0.1 um, and rounding.
            expect(abs(value - 6.35) <= 5e-4, f"{value} on the master ball")
        served.tell("ball out")
        for port in ports:
            value = float(ask(port, b"?"))
            # The free reading of an indicator placed by hand (paper, section 2.1).
            expect(-6.2 < value < -5.6, f"{value} when free")
            port.close()
        again = serial.Serial(served.indicators[0], 4800, timeout=2)
        expect(ask(again, b"PRE?") == b"+006.3500\r", "a client after the first")
        again.close()


def main():
    robot(*sys.argv[1:])
    indicators(*sys.argv[1:])
    print("py_openshowvar and pyserial drive the served cell")


if __name__ == "__main__":
    main()
