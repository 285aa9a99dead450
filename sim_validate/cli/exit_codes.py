"""The exit code of a command, and the message of an error."""

from enum import IntEnum

from grasp_core.errors import GraspError, SolverError, UndecidedError, UnfaithfulError
from sim_validate.cli.flag_bounds import FlagsError


class Exit(IntEnum):
    """Exit codes of the command."""

    GOOD = 0
    NEGATIVE = 1
    """The command ran, and at least one grasp or check failed."""
    USAGE = 2
    INTERNAL = 3
    INPUT = 4
    """The input was refused: a file, a flag or a value."""
    NONE = 5
    """The object has no grasp, as far as was asked."""
    PARTIAL = 6
    INTERRUPTED = 130


def reason_of(error: GraspError | OSError) -> str:
    """The message of an error for people, with the file it is about."""
    if isinstance(error, OSError):
        return f"{error.filename or 'output'}: {error.strerror or error}"
    return str(error)


def exit_code(error: GraspError | OSError) -> Exit:
    """The exit code of a command that ended with an error."""
    if isinstance(error, FlagsError):
        return Exit.USAGE
    ours = (SolverError, UndecidedError, UnfaithfulError)
    return Exit.INTERNAL if isinstance(error, ours) else Exit.INPUT
