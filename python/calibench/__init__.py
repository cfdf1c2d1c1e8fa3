"""Calibration of industrial robots: from measurements in arrays or data frames to a verdict and a calibrated URDF.

Every function runs the program ``calibench``, which is part of this package, and gives its documents and sentences unchanged. Angles are in degrees and
lengths in millimetres wherever a name does not say otherwise.
"""

from calibench._dataset import Columns, Dataset
from calibench._errors import CellError, Error, InputError, ProgramError
from calibench._program import program, version
from calibench._results import (
    Calibrated,
    Calibration,
    Compensated,
    Ladder,
    Model,
    Report,
    Result,
    Run,
    Step,
    Study,
)
from calibench._verbs import (
    add,
    calibrate,
    check,
    compare,
    diagnose,
    effects,
    fleet,
    identify,
    ladder,
    merge,
    next_measurements,
    report,
    robots,
    run,
    runs,
    study,
    validate,
)

__version__ = version()

__all__ = [
    "Calibrated",
    "Calibration",
    "CellError",
    "Columns",
    "Compensated",
    "Dataset",
    "Error",
    "InputError",
    "Ladder",
    "Model",
    "ProgramError",
    "Report",
    "Result",
    "Run",
    "Step",
    "Study",
    "add",
    "calibrate",
    "check",
    "compare",
    "diagnose",
    "effects",
    "fleet",
    "identify",
    "ladder",
    "merge",
    "next_measurements",
    "program",
    "report",
    "robots",
    "run",
    "runs",
    "study",
    "validate",
]
