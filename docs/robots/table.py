"""The table of the public robots: table.py RIVALS, the file that rivals.py has printed; on standard input, one after the other, the documents of
`calibench effects prove --json --rows`. Prints Markdown: what it comes to, by kind of division, then every division, worst first.
"""

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

#: A division and what came of it, with the ratios of the rivals: `recommended`, `gaussian_process`, `boosted_trees` over the default model.
Proof = dict[str, Any]

KINDS = {
    "random postures, short campaigns": {"postures", "short"},
    "blocks of joint space": {"blocks"},
    "places of the artifact": {"places"},
    "campaigns": {"campaigns"},
}
RATIOS = ["recommended", "gaussian_process", "boosted_trees"]
#: A predicted mean error is fair within these factors of the measured one.
FAIR = (0.8, 1.25)
#: Rows of the head, from either end.
ENDS = 5


def documents(text: str) -> Iterator[dict[str, Any]]:
    """JSON documents that follow each other."""
    decoder, at = json.JSONDecoder(), 0
    while text[at:].strip():
        at += len(text[at:]) - len(text[at:].lstrip())
        document, at = decoder.raw_decode(text, at)
        yield document


def joined(text: str, rivals: dict[str, Any]) -> list[Proof]:
    """All proofs with their ratios, worst first; of those that are alike, the larger error first."""
    proofs = []
    for proof in (p for document in documents(text) for p in document["proofs"]):
        proof |= rivals["divisions"][Path(proof["rows"]).name]
        proof["recommended"] = proof["recommended_mm"] / proof["default_mm"]
        proofs.append(proof)
    return sorted(proofs, key=lambda p: (round(p["recommended"], 3), p["recommended_mm"]), reverse=True)


def mean(proofs: list[Proof], name: str) -> float:
    return float(sum(p[name] for p in proofs)) / len(proofs)


def worst(proofs: list[Proof], name: str) -> float:
    return float(max(p[name] for p in proofs))


def fair(proofs: list[Proof], model: int) -> str:
    """How many predictions are fair, for the default (0) or the recommended model (1), of those that can be judged."""
    known = [p["predicted_over_measured"][model] for p in proofs]
    known = [x for x in known if x is not None]
    return f"{sum(FAIR[0] <= x <= FAIR[1] for x in known)} of {len(known)}" if known else "-"


def number(x: float | None, digits: int) -> str:
    return "-" if x is None else f"{x:.{digits}f}"


def row(cells: list[str]) -> str:
    return f"| {' | '.join(cells)} |"


def table(head: list[str], rows: list[list[str]]) -> str:
    return "\n".join([row(head), "|" + "---|" * len(head), *map(row, rows)])


def by_kind(proofs: list[Proof]) -> str:
    """A row for each kind of division."""
    rows = []
    for name, kinds in [*KINDS.items(), ("all", set().union(*KINDS.values()))]:
        own = [p for p in proofs if p["division"] in kinds]
        if own:
            ratios = [f"{mean(own, r):.3f}, {worst(own, r):.3f}" for r in RATIOS]
            rows.append([name, str(len(own)), *ratios, fair(own, 0), fair(own, 1)])
    head = ["left out", "divisions", "recommended / default: mean, largest", "Gaussian process", "boosted trees"]
    return table([*head, "predicted fairly: default", "recommended"], rows)


def ends(proofs: list[Proof]) -> str:
    """The worst and the best of them, in few columns."""
    chosen = proofs if len(proofs) <= 2 * ENDS else proofs[:ENDS] + proofs[-ENDS:]
    rows = [[p["robot"], p["fold"], f"{p['default_mm']:.3f}", f"{p['recommended_mm']:.3f}", *(number(p[r], 3) for r in RATIOS)] for p in chosen]
    if len(chosen) < len(proofs):
        rows.insert(ENDS, ["..."] + [""] * (len(rows[0]) - 1))
    return table(["data", "left out", "default mm", "recommended mm", "recommended / default", "Gaussian process", "boosted trees"], rows)


def all_of(proofs: list[Proof]) -> str:
    """Every division with every column."""
    rows = []
    for p in proofs:
        first, second = (number(x, 2) for x in p["predicted_over_measured"])
        errors = [number(p[f"{model}_mm"], 3) for model in ["geometry", "default", "recommended"]]
        ratios = [number(p[r], 3) for r in RATIOS]
        postures = ", ".join(map(str, p["postures"]))
        rows.append([p["robot"], p["fold"], postures, *errors, p["kind"], *ratios, first, second, p["verdict"], f"{p['seconds']:.1f}"])
    head = ["data", "left out", "postures fitted, judged", "geometry mm", "default mm", "recommended mm", "which", "recommended / default"]
    head += ["Gaussian process / default", "boosted trees / default", "predicted / measured: default", "recommended", "verdict", "s"]
    return table(head, rows)


def main() -> None:
    proofs = joined(sys.stdin.read(), json.loads(Path(sys.argv[1]).read_text(encoding="utf-8")))
    harmless, campaigns = sum(p["recommended"] <= 1.02 for p in proofs), len({p["robot"] for p in proofs})
    recommended, process, trees = (f"{mean(proofs, r):.3f} in the mean and {worst(proofs, r):.3f} at worst" for r in RATIOS)
    print(
        f"{len(proofs)} divisions of {campaigns} campaigns. Rms of the 3-D error on what was left out, over that of the default model: {recommended} "
        f"with what is recommended, at most 1.02 in {harmless}; {process} with a Gaussian process of x, y, z over joint angles; {trees} with boosted "
        f"trees. A mean error is predicted fairly when it is {FAIR[0]} to {FAIR[1]} times the measured one.\n"
    )
    print(f"{by_kind(proofs)}\n\nThe worst and the best:\n\n{ends(proofs)}\n\n## All divisions\n\n{all_of(proofs)}")


if __name__ == "__main__":
    main()
