"""The errors that the three packages raise on purpose, one class per cause."""

from enum import StrEnum


class GraspError(Exception):
    """Base of every error that graspproof raises on purpose."""


class InputError(GraspError):
    """A value passed in breaks the contract; the message says which, and how to correct it."""


class UndecidedError(GraspError):
    """The question lies closer to its boundary than the arithmetic can tell."""


class SolverError(GraspError):
    """A solver's answer failed our own check of it, so there is no answer."""


class NoForcesError(GraspError):
    """No forces within the limits and the friction balance the wrench."""


class UnfaithfulError(GraspError):
    """The simulator's settings do not reproduce statics, so nothing may be certified with them."""


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
    """A mesh cannot be taken as a solid polyhedron.

    Attributes:
        reason: The stable code of the refusal.
        message: What was expected, what came, and what to do.
    """

    def __init__(self, reason: MeshRefusal, message: str) -> None:
        super().__init__(reason, message)
        self.reason, self.message = reason, message

    def __str__(self) -> str:
        """Return the refusal's code and its message, on one line."""
        return f"{self.reason.value}: {self.message}"
