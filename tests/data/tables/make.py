"""Writes table.csv and table.xlsx: joints of a nominal UR5 and positions of a target on its flange, disturbed by 0.3 mm.

    python -m pip install numpy openpyxl
    python tests/data/tables/make.py
"""

import csv
from pathlib import Path

import numpy
from openpyxl import Workbook

ROWS = 40
# alpha (quarter turns), a, d of the manufacturer's distal table, m.
TABLE = [(1, 0.0, 0.089159), (0, -0.425, 0.0), (0, -0.39225, 0.0), (1, 0.0, 0.10915), (-1, 0.0, 0.09465), (0, 0.0, 0.0823)]


def transform(alpha, a, d, theta):
    c, s = numpy.cos(theta), numpy.sin(theta)
    ca, sa = [1, 0, -1][abs(alpha)], [0, 1, 0][abs(alpha)] * numpy.sign(alpha)
    return numpy.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]])


def main():
    random = numpy.random.default_rng(5)
    rows = []
    for k in range(ROWS):
        q = numpy.radians(random.uniform(-120, 120, 6))
        pose = numpy.eye(4)
        for (alpha, a, d), theta in zip(TABLE, q):
            pose = pose @ transform(alpha, a, d, theta)
        point = (pose @ [0.02, 0.01, 0.1, 1.0])[:3] * 1e3 + [1500.0, -300.0, 250.0] + random.normal(0.0, 0.3, 3)
        rows.append([f"p{k + 1}", *(round(float(v), 6) for v in q), *(round(float(v), 4) for v in point)])
    titles = ["point", *(f"q_{i}" for i in range(6)), "x [mm]", "y [mm]", "z [mm]"]
    here = Path(__file__).parent
    with open(here / "table.csv", "w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([titles, *rows])
    book = Workbook()
    book.active.title = "Remarks"
    book.active["A1"] = "measured by night"
    sheet = book.create_sheet("Measurements")
    for line, row in enumerate([titles, *rows]):
        for column, value in enumerate(row):
            # The table begins in B4.
            sheet.cell(line + 4, column + 2, value)
    book.save(here / "table.xlsx")


if __name__ == "__main__":
    main()
