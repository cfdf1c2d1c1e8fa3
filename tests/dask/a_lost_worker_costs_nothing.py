"""Some workers, one killed in the middle of its work: the table is that of one run, byte for byte.

    a_lost_worker_costs_nothing.py PROGRAM SCENARIO [TRIALS SHARD WORKERS [OPTION ...]]

OPTION is one of `sim study`, of both. It tells trials, workers and seconds.

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

TRIALS, SHARD, WORKERS = 60, 5, 2
PATIENCE_S = 24 * 3600
SCRIPT = Path(__file__).resolve().parents[2] / "sim" / "lab" / "dask" / "calibench_dask.py"


def busy_worker(root):
    """The process of a worker that has the program at work, or nothing yet."""
    for process in psutil.Process(root).children(recursive=True):
        try:
            if process.name().startswith("calibench") and process.ppid() != root:
                return process.ppid()
        except psutil.NoSuchProcess:
            continue
    return None


def main():
    program, scenario, *more = sys.argv[1:]
    trials, shard, workers = [int(n) for n in more[:3]] or (TRIALS, SHARD, WORKERS)
    options = more[3:]
    program = os.path.realpath(program)
    with tempfile.TemporaryDirectory() as folder:
        one, spread = Path(folder) / "one.csv", Path(folder) / "spread.csv"
        subprocess.run([program, "sim", "study", scenario, "--trials", str(trials), "--output", str(one), *options], check=True, capture_output=True)
        passed = ["--", *options] if options else []
        began = time.monotonic()
        command = [sys.executable, str(SCRIPT), "--trials", str(trials), "--shard", str(shard), "--workers", str(workers), "--program", program, "-o", str(spread), scenario, *passed]
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
            out, err = study.communicate(timeout=PATIENCE_S if more else 600)
        # Who does the work of the lost one, its successor or the other worker, is the cluster's affair.
        if study.returncode != 0 or f"{trials} trials in " not in out:
            raise SystemExit(f"it ended with {study.returncode}: {err[-2000:]}")
        if one.read_bytes() != spread.read_bytes():
            raise SystemExit("the tables differ")
    print(f"{trials} trials on {workers} workers, one of them killed, in {time.monotonic() - began:.0f} s: the same bytes as one run")


if __name__ == "__main__":
    main()
