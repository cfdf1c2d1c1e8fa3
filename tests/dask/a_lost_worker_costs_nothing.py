"""Two workers, one killed in the middle of its work: the table is that of one run, byte for byte.

    a_lost_worker_costs_nothing.py PROGRAM SCENARIO

What it needs is made by `tests/dask/run`. Ends with 1 and says why when it is not so.
"""

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import psutil

TRIALS, SHARD = 60, 5
SCRIPT = Path(__file__).resolve().parents[2] / "sim" / "lab" / "dask" / "calibench_dask.py"


def busy_worker(root):
    """The process of a worker that has the program at work, or nothing yet."""
    for process in psutil.Process(root).children(recursive=True):
        try:
            if process.name() == "calibench" and process.ppid() != root:
                return process.ppid()
        except psutil.NoSuchProcess:
            continue
    return None


def main():
    program, scenario = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        one, spread = Path(folder) / "one.csv", Path(folder) / "spread.csv"
        subprocess.run([program, "study", scenario, "--trials", str(TRIALS), "--output", str(one)], check=True, capture_output=True)
        command = [sys.executable, str(SCRIPT), scenario, "--trials", str(TRIALS), "--shard", str(SHARD), "--workers", "2", "--program", program, "-o", str(spread)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as study:
            # One shard is done, the next are in work.
            while "shards" not in (line := study.stderr.readline()):
                if not line:
                    raise SystemExit(f"it ended before a shard was done, with {study.wait()}")
            deadline = time.monotonic() + 60
            while (worker := busy_worker(study.pid)) is None and time.monotonic() < deadline:
                time.sleep(0.01)
            if worker is None:
                raise SystemExit("no worker was seen at work")
            os.kill(worker, signal.SIGKILL)
            out, err = study.communicate(timeout=600)
        # Who does the work of the lost one, its successor or the other worker, is the cluster's affair.
        if study.returncode != 0 or f"{TRIALS} trials in " not in out:
            raise SystemExit(f"it ended with {study.returncode}: {err[-2000:]}")
        if one.read_bytes() != spread.read_bytes():
            raise SystemExit("the tables differ")
    print(f"{TRIALS} trials on two workers, one of them killed: the same bytes as one run")


if __name__ == "__main__":
    main()
