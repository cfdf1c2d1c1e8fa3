"""Boosted trees over joint angles on the residual of the default model, as in docs/robots/rivals.py."""

import sys
from pathlib import Path

from division import correct, read

sys.path.append(str(Path(__file__).resolve().parents[1] / "docs" / "robots"))
import rivals  # noqa: E402

correct(read(), rivals.boosted_trees)
