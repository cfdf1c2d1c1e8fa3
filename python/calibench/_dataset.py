"""Measurements of one robot, from and to arrays and data frames."""

import csv
import os
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from calibench import _program
from calibench._errors import InputError

#: Columns of numbers (float64) and of text (object), by name.
Columns = dict[str, NDArray[Any]]
StrPath = str | os.PathLike[str]

_ANGLES = {"deg": "deg", "rad": "rad"}
_LENGTHS = {"mm": "mm", "m": "m", "um": "um"}
#: Quantities of single columns: the name here, the name of the map, whether they are numbers, and their unit in the map.
_SINGLE = {
    "session": ("session", False, None),
    "set": ("set", False, None),
    "repeat": ("repeat", False, None),
    "posture": ("posture", False, None),
    "target": ("target", False, None),
    "payload": ("payload", False, None),
    "id": ("id", False, None),
    "sigma_um": ("sigma", True, "um"),
    "sigma_deg": ("sigma_rotation", True, "deg"),
    "time_s": ("time", True, "s"),
    "temperature_c": ("temp", True, "c"),
}


class Table:
    """Something with columns."""

    def columns(self) -> Columns:
        """The columns of its table: float64 arrays, and object arrays of text. An empty cell of a column of numbers is NaN."""
        raise NotImplementedError

    def frame(self) -> Any:
        """The same as a pandas data frame."""
        try:
            import pandas  # type: ignore[import-untyped,unused-ignore]
        except ImportError as e:
            raise InputError("a data frame needs pandas: pip install pandas; or take the arrays of columns()") from e
        return pandas.DataFrame(self.columns())


class Dataset(Table, os.PathLike[str]):
    """A dataset: the folder of ``dataset.toml`` and ``samples.csv``."""

    def __init__(self, folder: StrPath, _keep: Any = None) -> None:
        self._folder = Path(folder)
        self._keep = _keep
        self.report = ""

    @classmethod
    def read(cls, folder: StrPath) -> "Dataset":
        """The dataset in a folder, which stays where it is."""
        if not (Path(folder) / "dataset.toml").is_file():
            raise InputError(f"{os.fspath(folder)}: is not a dataset; a dataset is a folder with dataset.toml and samples.csv")
        return cls(folder)

    @classmethod
    def import_(cls, format: str, files: Sequence[StrPath], *, map: StrPath | None = None, robot: str | None = None, set_up_of: StrPath | None = None, force: bool = False) -> "Dataset":
        """Other people's tables, as ``calibench import`` reads them: ``generic`` with a column map, ``ur5-jacobi``, ``ur10-ipa``, ``mukca``.

        With ``set_up_of`` base, tool and targets are those of that dataset, so that :func:`check` can compare the two.
        """
        keep = tempfile.TemporaryDirectory(prefix="calibench-")
        folder = Path(keep.name) / "data"
        arguments: list[StrPath] = ["import", format, *files, "-o", folder]
        arguments += ["--map", map] if map is not None else []
        arguments += ["--robot", robot] if robot is not None else []
        arguments += ["--set-up-of", set_up_of] if set_up_of is not None else []
        arguments += ["--force"] if force else []
        finished = _program.run(arguments)
        dataset = cls(folder, keep)
        dataset.report = finished.output
        return dataset

    @classmethod
    def from_frame(
        cls,
        frame: Any,
        *,
        robot: StrPath,
        joints: Sequence[str],
        points: Sequence[str],
        orientations: Sequence[str] | None = None,
        rotation: str = "vector",
        angles: str | None = None,
        lengths: str | None = None,
        tool: Sequence[float] | None = None,
        base: Sequence[float] | None = None,
        noise_um: float | None = None,
        noise_deg: float | None = None,
        columns: Mapping[str, str] | None = None,
        commanded: Sequence[str] | None = None,
        torques: Sequence[str] | None = None,
        set_up_of: StrPath | None = None,
        force: bool = False,
    ) -> "Dataset":
        """Measured points of the TCP, or whole poses, one row per posture.

        Args:
            frame: a pandas or polars data frame, a structured array, or a mapping of names to arrays.
            robot: a built-in robot, a robot file, or a URDF file (``arm.urdf#base_link:tool0`` between two links).
            joints: names of the columns of the joint angles, in the order of the joints; those of prismatic joints end in ``_mm``, ``_m`` or ``_um``.
            points: names of the columns of the measured x, y, z in the frame of the instrument.
            orientations: names of the columns of the measured orientation in the frame of the instrument.
            rotation: what these hold: ``vector`` (a rotation vector), ``abc`` (KUKA), ``rpy`` (ROS), ``xyz`` (about X, then the new Y, then the new Z), ``quaternion_xyzw`` or ``quaternion_wxyz``.
            angles: ``deg`` or ``rad``; not needed if the names of the joint columns end in ``_deg`` or ``_rad``.
            lengths: ``mm``, ``m`` or ``um``; not needed if the names of the point columns end so.
            tool: TCP on the flange, x, y, z (mm) and, if needed, A, B, C (deg); without it the tool is identified.
            base: nominal base in the frame of the instrument, likewise; without it a start is found from the data.
            noise_um: standard deviation of a coordinate of a point; without it the noise is estimated.
            noise_deg: standard deviation of an orientation about each axis; needed with ``orientations``, unless a column is ``sigma_deg``.
            columns: further columns by what they are: ``session``, ``set``, ``posture``, ``repeat``, ``target``, ``payload``, ``id``, ``sigma_um``, ``sigma_deg``, ``time_s``, ``temperature_c``.
            commanded: columns of the commanded joint angles, if ``joints`` are read back.
            torques: columns of the measured joint torques, N m; of prismatic joints, forces in columns that end in ``_n``.
            set_up_of: a dataset measured on the same set-up, from which base, tool and targets are taken instead of being found from the data; for ``check``.
            force: go on if the data do not fit the robot.

        Raises:
            InputError: a value that is not a number, with its row and column; or data that do not fit the robot, with the mistake that would explain it.
        """
        groups: list[tuple[str, Sequence[str], Sequence[str | None]]] = [
            ("q", joints, _joint_units(angles, joints)),
            ("xyz", points, [_unit("lengths", lengths, points, _LENGTHS)] * 3),
        ]
        if len(points) != 3:
            raise InputError(f"points: {len(points)} columns; give those of x, y and z")
        if commanded is not None:
            groups.append(("qcmd", commanded, _joint_units(angles, commanded)))
        if orientations is not None:
            angular = not rotation.startswith("quaternion")
            unit = _unit("angles", angles, orientations, _ANGLES) if angular else None
            groups.append(("rotation", orientations, [unit] * len(orientations)))
        if torques is not None:
            groups.append(("tau", torques, ["n" if name.endswith("_n") else "nm" for name in torques]))
        sources: dict[str, tuple[str, str | None, bool]] = {}
        for stem, names, units in groups:
            for k, (name, unit) in enumerate(zip(names, units, strict=True)):
                quantity = "xyz"[k] if stem == "xyz" else f"{stem}{k + 1}"
                sources[quantity] = (name, unit, True)
        for what, name in (columns or {}).items():
            if what not in _SINGLE:
                raise InputError(f"columns: there is no '{what}'; known are {', '.join(_SINGLE)}")
            quantity, is_number, unit = _SINGLE[what]
            sources[quantity] = (name, unit, is_number)
        table = {quantity: _column(frame, name, is_number) for quantity, (name, _, is_number) in sources.items()}
        lengths_of = {quantity: len(values) for quantity, values in table.items()}
        if len(set(lengths_of.values())) > 1:
            raise InputError("columns of different lengths: " + ", ".join(f"{sources[q][0]} {n}" for q, n in lengths_of.items()))
        if not next(iter(lengths_of.values())):
            raise InputError("the frame has no rows")
        with tempfile.TemporaryDirectory(prefix="calibench-") as name:
            inner = Path(name)
            _write_csv(inner / "frame.csv", table)
            (inner / "map.toml").write_text(_map({q: unit for q, (_, unit, _) in sources.items()}, _robot(robot), tool, base, (noise_um, noise_deg), rotation), encoding="utf-8")
            return cls.import_("generic", [inner / "frame.csv"], map=inner / "map.toml", set_up_of=set_up_of, force=force)

    @property
    def folder(self) -> Path:
        """Where its files are. Those of a dataset that was not written are removed with it."""
        return self._folder

    def __fspath__(self) -> str:
        return str(self._folder)

    def write(self, folder: StrPath) -> "Dataset":
        """Writes the dataset; the folder must not exist yet."""
        if Path(folder).exists():
            raise InputError(f"{os.fspath(folder)}: is there already; name a new folder")
        shutil.copytree(self._folder, folder)
        return Dataset(folder)

    def columns(self) -> Columns:
        return read_columns(self._folder / "samples.csv")

    def __len__(self) -> int:
        return len(next(iter(self.columns().values())))

    def __repr__(self) -> str:
        return f"<calibench dataset of {len(self)} samples in {self._folder}>"


def read_columns(path: Path) -> Columns:
    """The columns of a table that calibench has written."""
    with path.open(newline="", encoding="utf-8") as file:
        rows = csv.reader(file)
        names = next(rows)
        cells = list(zip(*rows, strict=True))
    columns: Columns = {}
    for name, values in zip(names, cells or [()] * len(names), strict=True):
        try:
            # Names are text even if they look like numbers.
            if name in _TEXTS:
                raise ValueError
            columns[name] = np.array([float(v) if v else np.nan for v in values])
        except ValueError:
            columns[name] = np.array(values, dtype=object)
    return columns


_TEXTS = {"id", "kind", "set", "session", "ball", "target", "anchor", "payload", "posture", "repeat", "status", "warnings"}


def _unit(argument: str, given: str | None, names: Sequence[str], known: Mapping[str, str]) -> str:
    if given is not None:
        if given not in known:
            raise InputError(f"{argument}: '{given}' is not a unit here; give one of {', '.join(known)}")
        return known[given]
    ends = {name.rsplit("_", 1)[-1] for name in names}
    if len(ends) == 1 and (end := ends.pop()) in known:
        return known[end]
    raise InputError(f"{argument}: the unit of {', '.join(names)} is not known; give {argument}={' or '.join(map(repr, known))}")


def _joint_units(angles: str | None, names: Sequence[str]) -> list[str | None]:
    """Units of joints: a prismatic one has that of a length at the end of its name."""
    ends = {name: name.rsplit("_", 1)[-1] if "_" in name else "" for name in names}
    turning = [name for name in names if ends[name] not in _LENGTHS]
    angle = _unit("angles", angles, turning, _ANGLES) if turning else None
    return [_LENGTHS.get(ends[name], angle) for name in names]


def _robot(robot: StrPath) -> str:
    """A reference that holds from anywhere."""
    text = os.fspath(robot)
    path, mark, ends = text.partition("#")
    return f"{Path(path).resolve()}{mark}{ends}" if Path(path).exists() else text


def _column(frame: Any, name: str, is_number: bool) -> NDArray[Any]:
    """A column as an array of finite numbers, or of text.

    Raises:
        InputError: with row and column, where a value is none.
    """
    try:
        raw = frame[name]
    except (KeyError, IndexError, ValueError, TypeError) as e:
        names = getattr(frame, "columns", None)
        names = getattr(getattr(frame, "dtype", None), "names", None) if names is None else names
        names = list(frame) if names is None and isinstance(frame, Mapping) else names
        known = f"; there are {', '.join(map(str, names))}" if names is not None and len(names) else ""
        raise InputError(f"there is no column '{name}'{known}") from e
    except Exception as e:  # polars has exceptions of its own
        raise InputError(f"there is no column '{name}': {e}") from e
    masked = np.ma.getmaskarray(raw) if isinstance(raw, np.ma.MaskedArray) else None
    values = np.asarray(raw.to_numpy() if hasattr(raw, "to_numpy") else raw)
    if values.ndim != 1:
        raise InputError(f"column '{name}' has the shape {values.shape}; give one value a row")
    if masked is not None and masked.any():
        raise InputError(f"row {int(np.flatnonzero(masked)[0])}, column '{name}': is masked; leave the row out or fill it")
    if not is_number:
        return np.array(["" if _is_missing(v) else _text(v) for v in values], dtype=object)
    if values.dtype.kind in "fiu":
        numbers = values.astype(np.float64)
    else:
        if values.dtype.kind not in "O":
            raise InputError(f"column '{name}' is of {values.dtype}; give numbers")
        numbers = np.empty(len(values))
        for row, value in enumerate(values):
            if isinstance(value, (bool, str, bytes)) or value is None:
                raise InputError(f"row {row}, column '{name}': {value!r} is not a number")
            try:
                numbers[row] = float(value)
            except (TypeError, ValueError) as e:
                raise InputError(f"row {row}, column '{name}': {value!r} is not a number") from e
    bad = np.flatnonzero(~np.isfinite(numbers))
    if bad.size:
        raise InputError(f"row {int(bad[0])}, column '{name}': {numbers[bad[0]]} is not a finite number; leave the row out")
    return numbers


def _is_missing(value: Any) -> bool:
    return value is None or (isinstance(value, float) and np.isnan(value))


def _text(value: Any) -> str:
    return str(int(value)) if isinstance(value, float) and value.is_integer() else str(value)


def _write_csv(path: Path, table: Columns) -> None:
    columns = [[repr(v) for v in values.tolist()] if values.dtype.kind == "f" else values.tolist() for values in table.values()]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(table)
        writer.writerows(zip(*columns, strict=True))


def _map(units: Mapping[str, str | None], robot: str, tool: Sequence[float] | None, base: Sequence[float] | None, noise: tuple[float | None, float | None], rotation: str) -> str:
    """The column map of a frame whose columns have the names of their quantities."""
    lines = ['format = "calibench-import/1"', "[columns]"]
    turns = [quantity for quantity in units if quantity.startswith("rotation")]
    for quantity, unit in units.items():
        of_unit = f', unit = "{unit}"' if unit else ""
        if quantity in turns:
            continue
        # Text may be missing in some rows.
        optional = "" if unit or quantity == "id" else ", optional = true"
        lines.append(f'{quantity} = {{ column = "{quantity}"{of_unit}{optional} }}')
    if turns:
        lines.insert(1, 'kind = "pose"')
        of_unit = f', unit = "{units[turns[0]]}"' if units[turns[0]] else ""
        lines += ["[rotation]", f"form = {_toml(rotation)}"]
        numbers = [f'{{ column = "{quantity}"{of_unit} }}' for quantity in turns]
        lines += [f"columns = [{', '.join(numbers)}]"]
    lines += ["[dataset]", f"robot = {_toml(robot)}"]
    lines += ["[dataset.tool]", *_frame("tool", tool if tool is not None else (0.0, 0.0, 0.0))]
    lines += ["free = true"] if tool is None else []
    lines += ["[dataset.base]", *_frame("base", base)] if base is not None else []
    lines += ["[dataset.noise]"]
    lines += [f"{key} = {float(value)!r}" for key, value in zip(["point_um", "orientation_deg"], noise, strict=True) if value is not None]
    return "\n".join(lines) + "\n"


def _frame(what: str, values: Sequence[float]) -> list[str]:
    numbers = [float(v) for v in values]
    if len(numbers) not in (3, 6):
        raise InputError(f"{what}: {len(numbers)} numbers; give x, y, z in mm, or x, y, z, A, B, C in mm and deg")
    names = ["x_mm", "y_mm", "z_mm", "a_deg", "b_deg", "c_deg"]
    return [f"{name} = {value!r}" for name, value in zip(names, numbers, strict=False)]


def _toml(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'
