"""The program in this package: where it is, and how it is run."""

import os
import shutil
import signal
import subprocess
import sysconfig
import threading
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from calibench._errors import CellError, InputError, ProgramError

_NAME = "calibench.exe" if os.name == "nt" else "calibench"
#: Seconds that an interrupted program has to end by itself.
_PATIENCE = 5.0


@cache
def program() -> Path:
    """The program. The environment variable ``CALIBENCH`` names another one."""
    if named := os.environ.get("CALIBENCH"):
        return Path(named)
    user = sysconfig.get_preferred_scheme("user")
    target = Path(__file__).resolve().parents[1]
    folders = [sysconfig.get_path("scripts"), sysconfig.get_path("scripts", scheme=user), str(target / "bin")]
    for folder in folders:
        path = Path(folder) / _NAME
        if path.is_file():
            return path
    if found := shutil.which(_NAME):
        return Path(found)
    raise ProgramError(f"the program {_NAME} is not in {', '.join(folders)}; install this package again")


@dataclass(frozen=True)
class Finished:
    """A run of the program that came to its end."""

    #: 0, or 1 if what was expected did not come true.
    code: int
    output: str


def run(arguments: Sequence[str | os.PathLike[str]], *, warn: bool = True) -> Finished:
    """Runs the program, and passes its warnings on unless they were passed on before. Python's other threads go on meanwhile; an interrupt ends the program too.

    Raises:
        InputError: what was given cannot be used.
        CellError: the cell or the disk failed.
        ProgramError: anything else.
    """
    command = [str(program()), *(os.fspath(argument) for argument in arguments)]
    with _interrupts_later() as interrupted:
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, encoding="utf-8")
    try:
        if interrupted:
            raise KeyboardInterrupt
        output, errors = process.communicate()
    except BaseException:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(_PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        raise
    said = [line for line in errors.splitlines() if line.strip()]
    if process.returncode not in (0, 1):
        raise _error(process.returncode, said)
    for line in said:
        if warn and line.lower().startswith("warning"):
            warnings.warn(line.split(":", 1)[-1].strip(), stacklevel=4)
    return Finished(process.returncode, output)


@contextmanager
def _interrupts_later() -> Iterator[list[int]]:
    """Collects interrupts: one while the program is being started would leave it behind, with nothing to end it by."""
    seen: list[int] = []
    if threading.current_thread() is not threading.main_thread():
        yield seen  # interrupts reach the main thread alone
        return
    before = signal.signal(signal.SIGINT, lambda number, _: seen.append(number))
    try:
        yield seen
    finally:
        signal.signal(signal.SIGINT, before)


def _error(code: int, said: list[str]) -> Exception:
    text = "\n".join(said).removeprefix("calibench: ")
    if code == 2:
        return InputError(text)
    if code == 3:
        return CellError(text)
    if code < 0:
        text = f"{text}\n" if text else ""
        return ProgramError(f"{text}the program was ended by signal {-code}")
    return ProgramError(text or f"the program ended with exit code {code}")


def version() -> str:
    """Version of the program."""
    from importlib.metadata import PackageNotFoundError
    from importlib.metadata import version as of

    try:
        return of("calibench")
    except PackageNotFoundError:
        return run(["--version"]).output.split()[-1]
