"""The verbs of the program as functions."""

import os
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from calibench import _program
from calibench._dataset import Dataset, StrPath
from calibench._errors import InputError
from calibench._results import Calibrated, Calibration, Ladder, Model, Report, Result, Run, Step, Study

#: A model: a file, the effects themselves, or ``None`` for the default one.
AnyModel = Model | StrPath | Sequence[str] | None
#: One dataset or several of one robot.
Data = Dataset | StrPath | Sequence[Dataset | StrPath]


def _several(data: Data) -> list[StrPath]:
    return [data] if isinstance(data, str | os.PathLike) else list(data)


def _model(model: AnyModel) -> tuple[list[StrPath], Model | None]:
    """The arguments of a model, and the file that must outlive them."""
    if model is None:
        return [], None
    if isinstance(model, str | os.PathLike):
        return ["--model", model], None
    written = Model.of(model)
    return ["--model", written], written


def _room() -> tuple[Path, "tempfile.TemporaryDirectory[str]"]:
    keep = tempfile.TemporaryDirectory(prefix="calibench-")
    return Path(keep.name), keep


def _checks(campaigns: Data) -> list[StrPath]:
    return [part for campaign in _several(campaigns) for part in ("--check", campaign)]


def _forced(force: bool) -> list[StrPath]:
    return ["--force"] if force else []


def calibrate(
    tables: Data,
    robot: StrPath | None = None,
    *,
    noise_um: float | None = None,
    tolerance_mm: float | None = None,
    folder: StrPath | None = None,
    force: bool = False,
) -> Calibrated:
    """Calibrates a robot from tables of joints and positions, or from a dataset, and judges it on a fifth of the postures, held out.

    Args:
        tables: files whose columns the program finds, or a dataset.
        robot: of tables, the built-in robot, robot file or URDF that was measured.
        noise_um: one-sigma of the instrument for each coordinate.
        tolerance_mm: the largest error that the robot may have.
        folder: where the results are kept; the default is a folder that goes with the object.
        force: go on with data that do not fit the robot.
    """
    room, keep = _room()
    stated = [("robot", robot), ("noise", None if noise_um is None else f"{noise_um}um"), ("tolerance", None if tolerance_mm is None else f"{tolerance_mm}mm")]
    given = [f"--{name}={value if isinstance(value, str) else os.fspath(value)}" for name, value in stated if value is not None]
    return Calibrated(["calibrate", *_several(tables), *given, *_forced(force)], Path(folder) if folder is not None else room / "calibrated", (keep, tables))


def identify(data: Data, model: AnyModel = None, *, shifts: bool = False, fleet: StrPath | None = None, force: bool = False) -> Calibration:
    """Identifies the robot's parameters. ``shifts`` shows how every effect missing from the model would move them; ``fleet`` is the file of :func:`fleet`."""
    folder, keep = _room()
    of_model, written = _model(model)
    arguments = ["identify", *_several(data), *of_model, *(["--shifts"] if shifts else []), *(["--fleet", fleet] if fleet is not None else []), *_forced(force)]
    return Calibration(arguments, folder / "calibration.toml", (keep, written))


def compare(calibration: Calibration | StrPath, data: Data, *, rows: str = "fit", set_up_anew: bool = False) -> Result:
    """Locates the errors of a calibration. ``rows`` are ``fit``, ``validation`` or ``all``."""
    of_rows = {"fit": [], "validation": ["--validation"], "all": ["--all"]}
    if rows not in of_rows:
        raise InputError(f"rows: '{rows}' is not a choice of rows; give one of {', '.join(of_rows)}")
    return Result(["compare", calibration, *_several(data), *of_rows[rows], *(["--set-up-anew"] if set_up_anew else [])], keep=(calibration, data))


def diagnose(data: Data, model: AnyModel = None, *, force: bool = False) -> Result:
    """Finds the effect missing from the model."""
    of_model, written = _model(model)
    return Result(["diagnose", *_several(data), *of_model, *_forced(force)], keep=(data, written))


def add(effect: str, data: Data, model: AnyModel = None, *, check: Data = (), force: bool = False) -> Step:
    """Adds one effect to the model, refits, and judges the step; ``ok`` says whether it was taken."""
    _, keep = _room()
    of_model, written = _model(model)
    step = Step(["add", effect, *_several(data), *of_model, *_checks(check), *_forced(force)], keep)
    step._keep = (keep, written, data)
    return step


def ladder(data: Data, model: AnyModel = None, *, check: Data = (), force: bool = False) -> Ladder:
    """Diagnoses, adds and refits until only noise remains or nothing helps."""
    _, keep = _room()
    of_model, written = _model(model)
    found = Ladder(["ladder", *_several(data), *of_model, *_checks(check), *_forced(force)], _several(data), keep)
    found._keep = (keep, written, data)
    return found


def next_measurements(data: Data, model: AnyModel = None, *, scenario: StrPath | None = None, seed: int = 1, force: bool = False) -> Result:
    """Proposes the measurements that best separate rival effects or most reduce the predicted error (``calibench plan next``)."""
    of_model, written = _model(model)
    of_scenario: list[StrPath] = ["--scenario", scenario] if scenario is not None else []
    return Result(["plan", "next", *_several(data), *of_model, *of_scenario, f"--seed={seed}", *_forced(force)], keep=(data, written))


def validate(calibration: Calibration | StrPath, data: Data, *, set_up_anew: bool = False, fitted: bool = False) -> Result:
    """Judges a calibration on poses that it has not seen; ``fitted`` asks for the residuals of the rows that were fitted, which are no errors."""
    flags = [*(["--set-up-anew"] if set_up_anew else []), *(["--fitted"] if fitted else [])]
    return Result(["validate", calibration, *_several(data), *flags], keep=(calibration, data))


def check(calibration: Calibration | StrPath, data: Dataset | StrPath | None = None, *, then: Dataset | StrPath, sentinels: int = 5) -> Result:
    """Tells by a few poses measured again whether a calibration still holds; ``ok`` says that nothing has changed.

    ``then`` is the campaign that was calibrated. Without ``data`` the poses to measure again are chosen.
    """
    chosen: list[StrPath] = [f"--sentinels={sentinels}"] if data is None else [data]
    return Result(["keep", "check", calibration, *chosen, "--then", then], keep=(calibration, data, then))


def runs(data: Data, model: AnyModel = None, *, dates: Sequence[str] = (), drift: Mapping[str, float] | None = None, at_most: int | None = None, predict: bool = True, force: bool = False) -> Result:
    """Compares many runs of one robot: what stayed, what moved, what belongs to one run only. ``drift`` is one sigma of a parameter's change in a month."""
    of_model, written = _model(model)
    of_dates: list[StrPath] = [f"--dates={','.join(dates)}"] if dates else []
    of_drift: list[StrPath] = [f"--drift={name}={size}" for name, size in (drift or {}).items()]
    of_rows: list[StrPath] = [f"--at-most={at_most}"] if at_most is not None else []
    arguments = ["keep", "runs", *_several(data), *of_model, *of_dates, *of_drift, *of_rows, *([] if predict else ["--no-prediction"]), *_forced(force)]
    return Result(arguments, keep=(data, written))


def fleet(calibrations: Sequence[Calibration | StrPath], *, out: StrPath | None = None) -> Result:
    """Learns from calibrations of robots of one type what they have in common; ``out`` is the file that ``identify`` takes."""
    of_output: list[StrPath] = ["-o", out] if out is not None else []
    return Result(["keep", "fleet", *calibrations, *of_output], keep=calibrations)


def report(data: Data, model: AnyModel = None, *, ladder: bool = False, force: bool = False) -> Report:
    """Makes the page of datasets or of the folder of a run: the errors in words, then in pictures."""
    folder, _keep = _room()
    of_model, _written = _model(model)
    page = folder / "report.html"
    _program.run(["report", *_several(data), *of_model, *(["--ladder"] if ladder else []), *_forced(force), "-o", page])
    return Report(page.read_text(encoding="utf-8"))


def run(scenario: StrPath, *, seed: int | None = None, out: StrPath | None = None) -> Run:
    """Runs the whole procedure on a simulated cell; ``ok`` says whether the scenario's expectations came true."""
    folder, keep = _room()
    of_seed: list[StrPath] = [f"--seed={seed}"] if seed is not None else []
    return Run(["run", scenario, *of_seed], folder / "run" if out is None else Path(out), keep)


def study(scenario: StrPath, *, trials: int, first: int = 0, seed: int | None = None, method: str = "both", diagnose: bool = False) -> Study:
    """Repeats the whole procedure with every error sampled again."""
    folder, keep = _room()
    of_seed: list[StrPath] = [f"--seed={seed}"] if seed is not None else []
    arguments: list[StrPath] = ["sim", "study", scenario, f"--trials={trials}", f"--first={first}", f"--method={method}", *of_seed, *(["--diagnose"] if diagnose else [])]
    return Study(arguments, folder / "trials.csv", keep)


def merge(shards: Sequence[Study | StrPath]) -> Result:
    """Combines the shards of a study and summarises them."""
    return Result(["sim", "merge", *shards], keep=shards)


def effects() -> Result:
    """The catalogue of effects."""
    return Result(["effects"])


def robots() -> Result:
    """The built-in robots."""
    return Result(["robots"])
