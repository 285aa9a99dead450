"""Flags for what a dataset holds on request for learners."""

from dataclasses import asdict, dataclass
from typing import Annotated, Any, Literal

from tyro.conf import UseAppendAction

from sim_validate.cli.flag_bounds import at_least

Varied = Annotated[int, at_least(0, up_to=100)]


@dataclass(frozen=True, slots=True)
class Learned:
    """What a dataset holds besides for learners; a TOML file can ask for more."""

    friction_below: Varied = 0
    """Rows per grasp with its contacts clearly below their critical friction."""
    friction_near: Varied = 0
    """Rows per grasp within some percent of the critical friction, on either side."""
    friction_above: Varied = 0
    """Rows per grasp clearly above the critical friction."""
    moved_out: Varied = 0
    """Rows per grasp with contacts moved on their faces, each out of its region."""
    figures: UseAppendAction[
        tuple[Literal["closure", "symmetry", "approach", "payload", "least_squeeze"], ...]
    ] = ()
    """Figures that each grasp has; may be repeated (see docs/datasets.md for what each costs)."""
    rests: bool = False
    """Write a table of the poses in which objects rest."""
    points: Annotated[int, at_least(0, up_to=100_000)] = 0
    """Number of points with normals to draw on each object's surface."""
    split_by: Literal["hash", "object", "class"] = "hash"
    """How objects are divided: by the hash of each, or counted by object or by class of shape, so
    that no split is empty."""
    units_in_names: bool = False
    """Read units from file names, as in bracket.mm.stl."""
    synthetic: Annotated[int, at_least(0, up_to=5)] = 5
    """Largest number of synthetic negative controls of each grasp."""
    hand: Literal["", "allegro", "allegro-urdf", "leap"] = ""
    """Hand whose pose is looked for in each grasp in force closure."""

    def asked(self) -> dict[str, Any] | None:
        """Return the settings that were given; None if all are the usual ones."""
        return None if self == Learned() else asdict(self)
