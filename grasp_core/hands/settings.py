"""Settings of the search for a pose of a hand; nothing here is slow to import, as help waits."""

from grasp_core.allowed_values import Direction, HandClearance, Seed, Starts
from grasp_core.declared import declared
from grasp_core.settings import Settings


@declared
class ReachSettings(Settings):
    """What is asked of the pose of a hand in a grasp.

    Raises:
        InputError: A number is out of its range.
    """

    regions: bool = True
    """Let contacts be anywhere in the grasp's regions, where it has some, not only where they are
    planned."""
    table_down: Direction | None = None
    """Downward direction in the object's frame: the object lies on a table across it, and the hand
    stays above the table. If not given, there is no table."""
    clearance_m: HandClearance = 5e-4
    """Least distance between all that must not touch [m]."""
    starts: Starts = 100
    """Largest number of starts for each choice of contacts."""
    seed: Seed = 0
    """Seed of the postures from which the search starts."""
