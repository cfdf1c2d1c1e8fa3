"""C and C++ of the peers: compiled for this machine, called by address."""

import ctypes
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np

#: What a user who wants speed compiles with.
FLAGS = ["-O3", "-march=native", "-DNDEBUG", "-shared", "-fPIC"]


def library(source: Path, *flags: str) -> ctypes.CDLL:
    """A source as a loaded library; the compiler is that of its suffix."""
    compiler = "g++" if source.suffix == ".cpp" else "gcc"
    if not shutil.which(compiler):
        raise SystemExit(f"{compiler} is needed (Debian, Ubuntu: apt install g++)")
    with tempfile.TemporaryDirectory() as scratch:
        built = Path(scratch) / "peer.so"
        subprocess.run([compiler, *FLAGS, str(source), *flags, "-o", str(built), "-lm"], check=True)
        return ctypes.CDLL(str(built))


def address(array: np.ndarray) -> ctypes.c_void_p:
    """Where the numbers of an array are, one after the other."""
    if array.dtype != np.float64 or not array.flags.c_contiguous:
        raise ValueError(f"C reads rows of doubles; this is {array.dtype} with strides {array.strides}")
    return ctypes.c_void_p(array.ctypes.data)
