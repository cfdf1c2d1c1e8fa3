"""Checks the peers, times them in turn with the benches on one core, prints a Markdown table: compare.py [WORK ...]."""

import os
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from statistics import median

import numpy as np

from benches import WORKS, Work, built, time_once
from compiled import FLAGS
from works import Peer

#: Each program is timed so often, in turn with the others, and at least so long each time, s.
ROUNDS, LONG = 3, 1.0
MODULES = {
    "casadi_peers": {"W1", "W2", "W5"},
    "jax_peers": {"W1", "W2", "W5"},
    "jax_trials": {"W4"},
    "mujoco_peers": {"W5", "W6"},
    "numba_peers": {"W1", "W5"},
    "numpy_peers": {"W1", "W2", "W5", "W6"},
    "numpy_selection": {"W3"},
    "numpy_trials": {"W4"},
    "pinocchio_peers": {"W1", "W5"},
    "scipy_peers": {"W2"},
}
PACKAGES = ["casadi", "jax", "mujoco", "numba", "numpy", "pin", "scipy"]


def say(text: str) -> None:
    """Progress, beside the table."""
    print(text, file=sys.stderr, flush=True)


def peers(wanted: set[str]) -> list[Peer]:
    """Those that do the wanted works, each checked when it is made."""
    found = []
    for module, works in MODULES.items():
        if works & wanted:
            found += [peer for peer in import_module(module).peers() if peer.work in wanted]
            say(f"{module}: checked")
    return found


def times(peer: Peer) -> list[float]:
    """Times of a unit of a peer's work, s."""
    found, ends = [], time.perf_counter() + LONG
    while time.perf_counter() < ends:
        began = time.perf_counter()
        peer.run()
        found.append((time.perf_counter() - began) / peer.units)
    return found


def figures(seconds: list[float]) -> np.ndarray:
    """Least and median."""
    return np.array([min(seconds), median(seconds)])


def written(pair: np.ndarray, digits: int = 3) -> str:
    """Least and median, to so many digits."""
    least, middle = (f"{x:,.0f}" if x >= 10 ** (digits - 1) else f"{x:#.{digits}g}" for x in pair)
    return f"{least} ({middle})"


def rows(work: Work, executable: Path, rivals: list[Peer]) -> Iterator[str]:
    """Rows of the table, the fastest peer first."""
    ours, theirs = defaultdict(list), defaultdict(list)
    for turn in range(ROUNDS):
        say(f"{work.name}: turn {turn + 1} of {ROUNDS}")
        for way, found in time_once(work, executable).items():
            ours[way] += found
        for peer in rivals:
            theirs[peer.name] += times(peer)
    here = {way: figures(seconds) for way, seconds in ours.items()}
    unit, name = (1e-6, "us") if max(pair[0] for pair in here.values()) < 1e-5 else (1e-3, "ms")
    first = (
        f"{work.name}, {work.unit}, {name}",
        "; ".join(f"{way} {written(pair / unit)}".strip() for way, pair in here.items()),
    )
    for peer, pair in sorted(((peer, figures(seconds)) for peer, seconds in theirs.items()), key=lambda row: row[1][0]):
        ratios = "; ".join(written(pair / own, 2) for own in here.values())
        yield f"| {first[0]} | {first[1]} | {peer} | {written(pair / unit)} | {ratios} |"
        first = "", ""


def surroundings() -> str:
    """On what, and by which versions, the table was measured."""
    processor = next(
        line.split(": ")[1] for line in Path("/proc/cpuinfo").read_text().splitlines() if line.startswith("model name")
    )
    compiler = subprocess.run(["g++", "-dumpfullversion"], check=True, capture_output=True, text=True).stdout.strip()
    packages = ", ".join(f"{package} {version(package)}" for package in PACKAGES)
    return f"One core of {processor}; {packages}; g++ {compiler}, {' '.join(FLAGS)}."


def main() -> None:
    """The table of the wanted works."""
    names = sys.argv[1:] or [work.name for work in WORKS]
    if unknown := set(names) - {work.name for work in WORKS}:
        raise SystemExit(f"there is no work {', '.join(sorted(unknown))}; there are {', '.join(work.name for work in WORKS)}")
    works = [work for work in WORKS if work.name in names]
    executables = built(works)
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    rivals = peers({work.name for work in works})
    print("| work | here: least (median) | peer | its time: least (median) | peer / here: least (median) |")
    print("|---|---|---|---|---|")
    for work in works:
        for row in rows(work, executables[work.bench], [peer for peer in rivals if peer.work == work.name]):
            print(row, flush=True)
    print(f"\n{surroundings()}")


main()
