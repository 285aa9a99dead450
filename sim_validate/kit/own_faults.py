"""Names the errors that one of several grasps may raise without harm to the others."""

from numpy.linalg import LinAlgError

from grasp_core.errors import InputError, NoForcesError, SolverError, UndecidedError

OWN_FAULTS = (
    InputError, UndecidedError, SolverError, NoForcesError, ArithmeticError, LinAlgError
)  # fmt: skip
"""What is wrong with a grasp, or with the numbers computed of it. `UnfaithfulError` is about the
simulator, so about every grasp."""
