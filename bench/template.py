"""A rival of your own: change `predict`, and run

    calibench bench --only ur5 --rival "mine=python3 bench/template.py" -o runs/bench

docs/bench.md says what is in the files. This one adds the mean residual of
the five nearest fitted postures to the default model, in joint space. It needs Python and nothing else.
"""

import csv
import math
import sys
from pathlib import Path

NEAREST = 5


def predict(fitted: list[dict[str, str]], judged: list[dict[str, str]]) -> list[list[float]]:
    """Positions of the measured point on the judged rows, mm, in the frame of the robot's base.

    A fitted row has joints (`q1_deg` and so on), the position by the default model (`default_x_mm`), as measured (`measured_x_mm`)
    and their difference (`residual_x_mm`); a judged row has the first two. Write a list of three numbers for each judged row.
    """
    joints = [name for name in judged[0] if name[0] == "q" and name[1].isdigit()]
    learned = [
        ([float(row[name]) for name in joints], [float(row[f"residual_{axis}_mm"]) for axis in "xyz"])
        for row in fitted
        if row["use"] == "fit"
    ]
    predicted = []
    for row in judged:
        here = [float(row[name]) for name in joints]
        near = sorted((math.dist(here, there), residual) for there, residual in learned)[:NEAREST]
        mean = [sum(residual[k] for _, residual in near) / len(near) for k in range(3)]
        predicted.append([float(row[f"default_{axis}_mm"]) + mean[k] for k, axis in enumerate("xyz")])
    return predicted


def read(path: Path) -> list[dict[str, str]]:
    """The rows of a file, by column; a missing file is an OSError."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    predicted = predict(read(folder / "fitted.csv"), read(folder / "judged.csv"))
    with (folder / "predicted.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["x_mm", "y_mm", "z_mm"])
        writer.writerows(predicted)
