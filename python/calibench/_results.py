"""Results: the documents and sentences of the program."""

import html
import json
import os
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

from calibench import _program
from calibench._dataset import Columns, Dataset, StrPath, Table, _column, _write_csv, read_columns
from calibench._errors import InputError

#: First words of verbs that have two.
_GROUPS = {"keep", "plan", "sim"}


class Result(Mapping[str, Any]):
    """The document of a verb, by its keys, as ``docs/schema`` describes it.

    ``print`` shows what the program prints; the text is worked out when it is first asked for.
    """

    def __init__(self, arguments: Sequence[StrPath], outputs: Sequence[StrPath] = (), keep: Any = None) -> None:
        self._arguments = list(arguments)
        self._keep = keep
        finished = _program.run([*arguments, *outputs, "--json"])
        self._json = finished.output
        self.ok = finished.code == 0

    def json(self) -> str:
        """The JSON document, byte for byte as the program prints it."""
        return self._json

    @cached_property
    def _document(self) -> dict[str, Any]:
        document = json.loads(self._json)
        return document if isinstance(document, dict) else {"items": document}

    def to_dict(self) -> dict[str, Any]:
        """The document."""
        return self._document

    def __getitem__(self, key: str) -> Any:
        return self._document[key]

    def __iter__(self) -> Any:
        return iter(self._document)

    def __len__(self) -> int:
        return len(self._document)

    @cached_property
    def _text(self) -> str:
        return _program.run(self._arguments, warn=False).output

    def __str__(self) -> str:
        return self._text

    def __repr__(self) -> str:
        verb = self._arguments[: 2 if self._arguments[0] in _GROUPS else 1]
        return f"<calibench {' '.join(map(str, verb))}: {', '.join(self._document)}>"

    def _repr_html_(self) -> str:
        return f'<pre style="line-height: 1.2; white-space: pre; overflow-x: auto">{html.escape(self._text)}</pre>'


class Model(os.PathLike[str]):
    """A model file: the effects that an identification may use."""

    def __init__(self, path: Path, keep: Any = None) -> None:
        self._path = path
        self._keep = keep

    @classmethod
    def of(cls, effects: Sequence[str]) -> "Model":
        """A model of these effects, as :func:`calibench.effects` lists them."""
        keep = tempfile.TemporaryDirectory(prefix="calibench-")
        path = Path(keep.name) / "model.toml"
        if isinstance(effects, str):
            raise InputError("effects: a text; give a list of effects, or a path of a model file")
        path.write_text(f"effects = [{', '.join(json.dumps(e) for e in effects)}]\n", encoding="utf-8")
        return cls(path, keep)

    def __fspath__(self) -> str:
        return str(self._path)

    def __str__(self) -> str:
        return self._path.read_text(encoding="utf-8")

    def write(self, path: StrPath) -> None:
        """Writes the model file."""
        shutil.copyfile(self._path, path)


class Calibration(Result, os.PathLike[str]):
    """An identified robot."""

    def __init__(self, arguments: Sequence[StrPath] | None, path: Path, keep: Any = None) -> None:
        self._path = path
        self._file_keep = keep
        if arguments is not None:
            super().__init__(arguments, ["-o", path], keep)
        else:
            self._arguments, self._json, self.ok = ["identify"], "{}", True

    @classmethod
    def read(cls, path: StrPath) -> "Calibration":
        """A calibration file; it stays where it is, has no document, and prints as it is written."""
        if not Path(path).is_file():
            raise InputError(f"{os.fspath(path)}: there is no such file; give a calibration that `identify` has written")
        return cls(None, Path(path))

    @cached_property
    def _text(self) -> str:
        if len(self._arguments) == 1:
            return self._path.read_text(encoding="utf-8")
        return _program.run(self._arguments, warn=False).output

    def __fspath__(self) -> str:
        return str(self._path)

    def write(self, path: StrPath) -> None:
        """Writes the calibration file."""
        shutil.copyfile(self._path, path)

    def urdf(self, path: StrPath, of: StrPath | None = None) -> None:
        """Writes the rigid part of the identified robot as a URDF; with ``of`` the same file with calibrated joint origins."""
        arguments: list[StrPath] = ["compensate", self._path, "--urdf", path]
        _program.run([*arguments, *(["--urdf-of", of] if of is not None else [])])

    def compensate(
        self,
        targets: Any,
        *,
        base: str | Sequence[float] | None = None,
        tool: Sequence[float] | None = None,
        session: str | None = None,
    ) -> "Compensated":
        """The targets to command so that the tool reaches the desired ones.

        Args:
            targets: a frame or mapping with ``id`` and ``x_mm, y_mm, z_mm, a_deg, b_deg, c_deg``, or with ``id`` and ``q1_deg`` ...
            base: the frame of the targets, ``world``, or X, Y, Z, A, B, C (mm, deg); the default is the base link.
            tool: the TCP on the flange, likewise; the default is the tool of the calibration.
            session: the set-up, if there are several.
        """
        return Compensated(self, targets, base, tool, session)


class Compensated(Result, Table):
    """Compensated targets."""

    def __init__(self, calibration: Calibration, targets: Any, base: str | Sequence[float] | None, tool: Sequence[float] | None, session: str | None) -> None:
        keep = tempfile.TemporaryDirectory(prefix="calibench-")
        folder = Path(keep.name)
        names = [str(n) for n in (targets.columns if hasattr(targets, "columns") and not callable(targets.columns) else targets)]
        texts = {"id", "payload", "s", "t"}
        _write_csv(folder / "targets.csv", {name: _column(targets, name, name not in texts) for name in names})
        self._fake = folder / "fake.csv"
        arguments: list[StrPath] = ["compensate", calibration, folder / "targets.csv", "-o", self._fake]
        for name, frame in [("base", base), ("tool", tool)]:
            if frame is not None:
                arguments.append(f"--{name}={frame if isinstance(frame, str) else _six(name, frame)}")
        arguments += [f"--session={session}"] if session is not None else []
        super().__init__(arguments, keep=keep)

    def columns(self) -> Columns:
        """The table of the fake targets, with the status of each."""
        return read_columns(self._fake)


def _six(name: str, frame: Sequence[float]) -> str:
    """A frame as an argument; without angles it is not turned."""
    values = [float(v) for v in frame]
    if len(values) not in (3, 6):
        raise InputError(f"{name}: {len(values)} numbers; give X, Y, Z in mm, or X, Y, Z, A, B, C in mm and deg")
    return ",".join(map(repr, [*values, 0.0, 0.0, 0.0][:6]))


class Step(Result):
    """An effect added to a model, and what came of it."""

    def __init__(self, arguments: Sequence[StrPath], keep: Any) -> None:
        path = Path(keep.name) / "model.toml"
        super().__init__(arguments, ["-o", path], keep)
        #: The new model.
        self.model = Model(path, keep)


class Ladder(Result):
    """The ladder of models, and the one that it recommends."""

    def __init__(self, arguments: Sequence[StrPath], datasets: Sequence[StrPath], keep: Any) -> None:
        path = Path(keep.name) / "recommended.toml"
        super().__init__(arguments, ["-o", path], keep)
        self._datasets = list(datasets)
        #: The recommended model.
        self.model = Model(path, keep)

    @cached_property
    def calibration(self) -> Calibration:
        """The robot identified by the recommended model."""
        keep = tempfile.TemporaryDirectory(prefix="calibench-")
        return Calibration(["identify", *self._datasets, "--model", self.model], Path(keep.name) / "calibration.toml", keep)

    def urdf(self, path: StrPath, of: StrPath | None = None) -> None:
        """Writes the rigid part of the robot that the recommended model identifies, as :meth:`Calibration.urdf` does."""
        self.calibration.urdf(path, of)


class Calibrated(Result):
    """A robot calibrated from tables, judged on poses held out; ``ok`` says whether the tolerance is met.

    ``print`` shows the errors before and after, what is to be expected, the cause, and what to do.
    """

    def __init__(self, arguments: Sequence[StrPath], folder: Path, keep: Any) -> None:
        self._arguments = [*arguments, "-o", folder]
        self._keep = keep
        finished = _program.run(self._arguments)
        self._said = finished.output
        self._json = (folder / "judgement.json").read_text(encoding="utf-8")
        self.ok = finished.code == 0
        #: The folder with calibration, model, URDF, report and dataset.
        self.folder = folder
        #: The recommended model.
        self.model = Model(folder / "model.toml", keep)
        #: The robot identified by it.
        self.calibration = Calibration.read(folder / "calibration.toml")

    @cached_property
    def _text(self) -> str:
        return self._said

    @property
    def report(self) -> "Report":
        """The page that shows it."""
        return Report((self.folder / "report.html").read_text(encoding="utf-8"))


class Report:
    """A page in one HTML file: the errors in words, then in pictures."""

    def __init__(self, page: str) -> None:
        self.page = page

    def write(self, path: StrPath) -> None:
        """Writes the page."""
        Path(path).write_text(self.page, encoding="utf-8")

    def _repr_html_(self) -> str:
        return f'<iframe style="width: 100%; height: 48em; border: 1px solid #ccc" sandbox="allow-scripts" srcdoc="{html.escape(self.page)}"></iframe>'


class Run(Result):
    """A simulated calibration: the whole procedure in a scenario."""

    def __init__(self, arguments: Sequence[StrPath], folder: Path, keep: Any) -> None:
        super().__init__(arguments, ["--out", folder], keep)
        #: The folder of the run.
        self.folder = folder

    @property
    def datasets(self) -> dict[str, Dataset]:
        """The datasets of the run by the names of their folders."""
        return {path.parent.name: Dataset(path.parent, self) for path in sorted(self.folder.glob("*/dataset.toml"))}

    def columns(self, table: str) -> Columns:
        """A table of the run, for instance ``probings.csv``."""
        path = self.folder / table
        if not path.is_file():
            known = ", ".join(str(p.relative_to(self.folder)) for p in sorted(self.folder.rglob("*.csv")))
            raise InputError(f"there is no table '{table}'; there are {known}")
        return read_columns(path)


class Study(Result, Table, os.PathLike[str]):
    """Many trials of a scenario."""

    def __init__(self, arguments: Sequence[StrPath], table: Path, keep: Any) -> None:
        super().__init__(arguments, ["-o", table], keep)
        self._table = table

    def __fspath__(self) -> str:
        return str(self._table)

    def columns(self) -> Columns:
        """The table of the trials."""
        return read_columns(self._table)
