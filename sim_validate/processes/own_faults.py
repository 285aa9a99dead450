"""Names the errors that end the work on one of several grasps, and not that on the others."""

from numpy.linalg import LinAlgError

from grasp_core.errors import InputError, NoForcesError, SolverError, UndecidedError

OWN_FAULTS = (
    InputError, UndecidedError, SolverError, NoForcesError, ArithmeticError, LinAlgError
)  # fmt: skip
"""Errors about one grasp, or about the numbers that are computed of it; its result is the reason.
`UnfaithfulError` is about the simulator, so about every grasp."""
