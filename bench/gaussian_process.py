"""A Gaussian process of x, y, z over joint angles on the residual of the default model, as in docs/robots/rivals.py."""

import sys
import warnings
from pathlib import Path

from division import correct, read
from sklearn.exceptions import ConvergenceWarning

sys.path.append(str(Path(__file__).resolve().parents[1] / "docs" / "robots"))
import rivals  # noqa: E402

warnings.simplefilter("ignore", ConvergenceWarning)
correct(read(), rivals.gaussian_process)
