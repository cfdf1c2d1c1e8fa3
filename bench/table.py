"""The tables of docs/bench.md from a leaderboard: table.py leaderboard.json [docs/bench.md], which is rewritten from its mark on to the next heading.

The standings, the worst first; the mean ratios for each kind of division; every division, those first where the recommendation of calibench is worst.
"""

import json
import math
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

MARK, NEXT = "<!-- bench -->", "\n## "
KINDS = {
    "postures": "random postures",
    "short": "short campaigns",
    "blocks": "blocks of joint space",
    "places": "places",
    "campaigns": "campaigns",
}


def row(*cells: object) -> str:
    return "| " + " | ".join(str(cell) for cell in cells) + " |"


def headed(*titles: str) -> list[str]:
    return [row(*titles), "|---" * len(titles) + "|"]


def mean(ratios: list[float]) -> float:
    """The geometric mean."""
    return math.exp(sum(map(math.log, ratios)) / len(ratios))


def tables(document: dict[str, Any]) -> str:
    standings, divisions = document["standings"], document["divisions"]
    methods = [standing["method"] for standing in standings]
    by_division: dict[str, dict[str, dict[str, Any]]] = defaultdict(dict)
    for entry in divisions:
        by_division[entry["division"]][entry["method"]] = entry
    robots = {entry["robot"] for entry in divisions}
    out = [f"{len(by_division)} divisions of {len(robots)} robots, seed {document['seed']}; the worst come first.", ""]
    out += headed(
        "method",
        "mean error over that of `default`: mean, 95 %",
        "largest",
        "worse by 2 %",
        "no prediction",
        "median of the mean errors mm",
        "expected over measured within 0.8 to 1.25",
        "median s",
    )
    for s in standings:
        low, high = s["interval"]
        out.append(
            row(
                f"`{s['method']}`",
                f"{s['ratio']:.3f}, {low:.3f} to {high:.3f}",
                f"{s['worst']:.3f}",
                f"{s['worse']} of {s['divisions']}",
                s["failed"] or "-",
                f"{s['median_mm']:.3f}" if s["median_mm"] is not None else "-",
                f"{s['fair']} of {s['expected']}" if s["expected"] else "-",
                f"{s['seconds']:.2f}",
            )
        )
    out += ["", "The same mean ratio by kind of division, each division once:", ""]
    out += headed("left out", "divisions", *(f"`{method}`" for method in methods))
    for kind, name in KINDS.items():
        of_kind = [entries for entries in by_division.values() if entries["default"]["kind"] == kind]
        if of_kind:
            ratios = (f"{mean([entries[method]['ratio'] for entries in of_kind]):.3f}" for method in methods)
            out.append(row(name, len(of_kind), *ratios))
    out += ["", "Every division, the mean error of the default model with its 95 % interval, and the ratios to it; `x` is no prediction:", ""]
    out += headed("division", "default mm", *(f"`{method}`" for method in methods if method != "default"))
    for division, entries in sorted(by_division.items(), key=lambda item: -item[1]["recommended"]["ratio"]):
        judged = entries["default"]["judged"]
        low, high = judged["interval_mm"]
        ratios = [
            f"{entries[method]['ratio']:.3f}" if entries[method]["judged"] else "x" for method in methods if method != "default"
        ]
        out.append(row(division, f"{judged['mean_mm']:.3f}, {low:.3f} to {high:.3f}", *ratios))
    return "\n".join(out) + "\n"


def main() -> None:
    text = tables(json.loads(Path(sys.argv[1]).read_text(encoding="utf-8")))
    if len(sys.argv) < 3:
        print(text, end="")
        return
    page = Path(sys.argv[2])
    before, after = page.read_text(encoding="utf-8").split(MARK, 1)
    page.write_text(f"{before}{MARK}\n\n{text}{after[after.index(NEXT) :]}", encoding="utf-8")


if __name__ == "__main__":
    main()
