"""Chooses the exit code of a command, and the message, when it ends with an error."""

from enum import IntEnum

from grasp_core.errors import (
    GraspError,
    InputError,
    SolverError,
    UndecidedError,
    UnfaithfulError,
)


class FlagsError(InputError):
    """Error for flags that contradict each other, or an unknown flag in a config file."""


class Exit(IntEnum):
    """Exit codes of the program `graspproof`."""

    GOOD = 0
    NEGATIVE = 1
    """The command ran, and at least one grasp or check failed."""
    USAGE = 2
    INTERNAL = 3
    INPUT = 4
    """The input was refused: a file, a flag or a value."""
    NONE = 5
    """No grasp of the object was found."""
    PARTIAL = 6
    INTERRUPTED = 130


def reason_of(error: GraspError | OSError) -> str:
    """Return the message of an error, with the name of the file that the error is about."""
    if isinstance(error, OSError):
        return f"{error.filename or 'output'}: {error.strerror or error}"
    return str(error)


def exit_code(error: GraspError | OSError) -> Exit:
    """Choose the exit code of a command that ended with an error."""
    if isinstance(error, FlagsError):
        return Exit.USAGE
    ours = (SolverError, UndecidedError, UnfaithfulError)
    return Exit.INTERNAL if isinstance(error, ours) else Exit.INPUT
