"""Our side: the benches of this repository, built by cargo and run one work at a time."""

import json
import os
import re
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Timing:
    """A way in which a bench does a work."""

    #: What distinguishes it from other ways of the same work.
    way: str
    #: Criterion's name of it, and units of work in one of its iterations.
    criterion: str
    units: int
    #: As what the bench prints the least time of a short run, where it does.
    least: str | None = None


@dataclass(frozen=True)
class Work:
    """A work of the benches."""

    name: str
    #: What a unit of it is.
    unit: str
    package: str
    bench: str
    timings: Sequence[Timing]


MANY = "100,000 configurations/"
W1, W5 = "W1 pose, 31 columns, torques", "W5 torques"
WORKS = [
    Work(
        "W1",
        "pose, 31 columns, torques of a configuration",
        "calibench",
        "kinematics",
        [
            Timing("alone", MANY + W1, 100_000, W1),
            Timing("side by side", MANY + "W1 side by side", 100_000, "W1 side by side"),
        ],
    ),
    Work(
        "W5",
        "torques of a configuration",
        "calibench",
        "kinematics",
        [
            Timing("alone", MANY + W5, 100_000, W5),
            Timing("side by side", MANY + "W5 side by side", 100_000, "W5 side by side"),
        ],
    ),
    Work("W2", "one identification", "calibench", "identification", [Timing("", "W2/identification", 1, "identification")]),
    # The least that the bench prints is of one seed; criterion's iterations take others, as the peer's runs do.
    Work("W3", "one start", "calibench", "selection", [Timing("", "W3/80 of 5,000, one start", 1)]),
    Work("W4", "one trial", "calibench", "trial", [Timing("", "W4/trial", 1, "W4 trial")]),
    Work(
        "W6",
        "readings of a ball's centre",
        "calibench-sim",
        "contact",
        [Timing("", "W6/three readings of 10,000 centres", 10_000)],
    ),
]


def built(works: Sequence[Work]) -> dict[str, Path]:
    """Executables of the benches of these works."""
    found = {}
    for package in {work.package for work in works}:
        benches = sorted({work.bench for work in works if work.package == package})
        command = ["cargo", "bench", "--no-run", "--message-format", "json", "--package", package]
        for bench in benches:
            command += ["--bench", bench]
        messages = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout
        for message in map(json.loads, messages.splitlines()):
            if message.get("executable") and message["target"]["name"] in benches:
                found[message["target"]["name"]] = Path(message["executable"])
    return found


def time_once(work: Work, executable: Path) -> dict[str, list[float]]:
    """Times of a unit, s, by the way it was done: one run of the bench."""
    wanted = "|".join(re.escape(timing.criterion) for timing in work.timings)
    with tempfile.TemporaryDirectory() as scratch:
        command = [str(executable), "--bench", "--quick", f"^({wanted})$"]
        said = subprocess.run(
            command, cwd=ROOT, env=os.environ | {"CRITERION_HOME": scratch}, check=True, capture_output=True, text=True
        ).stdout
        found = {}
        for timing in work.timings:
            sample = json.loads((Path(scratch) / timing.criterion / "new/sample.json").read_text())
            found[timing.way] = [t / n / timing.units / 1e9 for t, n in zip(sample["times"], sample["iters"], strict=True)]
            if timing.least:
                least = re.search(rf"^{re.escape(timing.least)}: least ([\d.]+) us$", said, re.MULTILINE)
                found[timing.way].append(float(least[1]) / 1e6)
    return found
