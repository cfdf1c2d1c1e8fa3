"""Exceptions, with the sentences of the program."""


class Error(Exception):
    """Anything that calibench could not do."""


class InputError(Error, ValueError):
    """Data, a file or an argument that cannot be used (exit code 2 of the program)."""


class CellError(Error, RuntimeError):
    """The cell or the disk failed during the work (exit code 3)."""


class ProgramError(Error, RuntimeError):
    """The program ended in another way than it should."""
