"""Defines the errors that graspproof raises on purpose, one class per cause."""

from collections.abc import Generator
from contextlib import contextmanager
from enum import StrEnum


class GraspError(Exception):
    """Base of every error that graspproof raises on purpose."""


class InputError(GraspError):
    """Raised when a value passed in breaks the contract; the message says how to correct it."""


class UndecidedError(GraspError):
    """Raised when a question is too close to its boundary for the arithmetic to decide."""


class SolverError(GraspError):
    """Raised when a solver's answer failed graspproof's own check, so there is no answer."""


class NoForcesError(GraspError):
    """Raised when no forces within the limits and the friction balance the wrench."""


class UnfaithfulError(GraspError):
    """Raised when the simulator does not reproduce statics, so it may certify nothing."""


class MeshRefusal(StrEnum):
    """The reasons why a mesh is not accepted; each value is the stable code shown to users."""

    UNREADABLE = "GP-MESH-UNREADABLE"
    FORMAT = "GP-MESH-FORMAT"
    EMPTY = "GP-MESH-EMPTY"
    NON_FINITE = "GP-MESH-NON-FINITE"
    INDEX = "GP-MESH-INDEX"
    SIZE = "GP-MESH-SIZE"
    TOO_MANY = "GP-MESH-TOO-MANY"
    OPEN = "GP-MESH-OPEN"
    NON_MANIFOLD = "GP-MESH-NON-MANIFOLD"
    WINDING = "GP-MESH-WINDING"
    ZERO_VOLUME = "GP-MESH-ZERO-VOLUME"
    OVERLAP = "GP-MESH-OVERLAP"
    SEPARATE = "GP-MESH-SEPARATE"
    NOT_FLAT = "GP-MESH-NOT-FLAT"
    POLYGON = "GP-MESH-POLYGON"
    UNSUPPORTED = "GP-MESH-UNSUPPORTED"
    LIMIT = "GP-MESH-LIMIT"


class MeshError(InputError):
    """Raised when a mesh cannot be taken as a solid polyhedron.

    Attributes:
        reason: The stable code of the refusal.
        message: What was expected, what came, and what to do.
    """

    def __init__(self, reason: MeshRefusal, message: str) -> None:
        super().__init__(reason, message)
        self.reason, self.message = reason, message

    def __str__(self) -> str:
        return f"{self.reason.value}: {self.message}"


@contextmanager
def about(where: object) -> Generator[None]:
    """Put the name of a file or a place in front of what an `InputError` in the block says."""
    try:
        yield
    except MeshError as error:
        raise MeshError(error.reason, f"{where}: {error.message}") from error
    except InputError as error:
        raise InputError(f"{where}: {error}") from error
