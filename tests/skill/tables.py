"""Tables as people hand them over, and the maps that docs/agents.md has for them."""

import csv
import zipfile
from pathlib import Path
from xml.sax.saxutils import escape

OFFICE = "http://schemas.openxmlformats.org"
DECLARATION = '<?xml version="1.0" encoding="UTF-8"?>'
# The parts of a workbook of one sheet, but for the sheet.
PARTS = {
    "[Content_Types].xml": f'<Types xmlns="{OFFICE}/package/2006/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Override PartName="/xl/workbook.xml" ContentType="application/vnd.openxmlformats-officedocument.spreadsheetml.sheet.main+xml"/>'
    '<Override PartName="/xl/worksheets/sheet1.xml" ContentType="application/vnd.openxmlformats-officedocument.spreadsheetml.worksheet+xml"/></Types>',
    "_rels/.rels": f'<Relationships xmlns="{OFFICE}/package/2006/relationships">'
    f'<Relationship Id="r1" Type="{OFFICE}/officeDocument/2006/relationships/officeDocument" Target="xl/workbook.xml"/></Relationships>',
    "xl/workbook.xml": f'<workbook xmlns="{OFFICE}/spreadsheetml/2006/main" xmlns:r="{OFFICE}/officeDocument/2006/relationships">'
    '<sheets><sheet name="Tracker" sheetId="1" r:id="r1"/></sheets></workbook>',
    "xl/_rels/workbook.xml.rels": f'<Relationships xmlns="{OFFICE}/package/2006/relationships">'
    f'<Relationship Id="r1" Type="{OFFICE}/officeDocument/2006/relationships/worksheet" Target="worksheets/sheet1.xml"/></Relationships>',
}


def rows_of(path: Path, delimiter: str = ",") -> list[dict[str, float]]:
    """The rows of which every cell is a number, decimal commas or points."""
    made = []
    with path.open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file, delimiter=delimiter):
            try:
                made.append({title: float(cell.replace(",", ".")) for title, cell in row.items()})
            except ValueError:
                continue
    return made


def write(path: Path, titles: list[str], rows: list[list], delimiter: str = ",") -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, delimiter=delimiter, lineterminator="\n").writerows([titles, *rows])


def workbook(path: Path, titles: list[str], rows: list[list]) -> None:
    def cell(value: object) -> str:
        if isinstance(value, str):
            return f'<c t="inlineStr"><is><t>{escape(value)}</t></is></c>'
        return f"<c><v>{value!r}</v></c>"

    lines = "".join(f"<row>{''.join(cell(value) for value in row)}</row>" for row in [titles, *rows])
    sheet = f'<worksheet xmlns="{OFFICE}/spreadsheetml/2006/main"><sheetData>{lines}</sheetData></worksheet>'
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in (PARTS | {"xl/worksheets/sheet1.xml": sheet}).items():
            archive.writestr(name, DECLARATION + content)


def map_of(
    path: Path, robot: str, columns: dict[str, tuple[str, str, str]], head: str = "", more: str = "", noise: str = "", sigma: float = 30.0
) -> None:
    """Column, unit and what follows it, by our name."""
    lines = []
    for ours, (theirs, unit, rest) in columns.items():
        stated = f', unit = "{unit}"' if unit else ""
        lines.append(f'{ours} = {{ column = "{theirs}"{stated}{rest} }}\n')
    text = f'format = "calibench-import/1"\n{head}\n[columns]\n{"".join(lines)}\n[dataset]\nrobot = "{robot}"\n\n'
    text += "[dataset.tool]\nx_mm = 0.0\ny_mm = 0.0\nz_mm = 0.0\nfree = true\n\n"
    path.write_text(f"{text}[dataset.noise]\npoint_um = {sigma}\n{noise}\n{more}", encoding="utf-8")
