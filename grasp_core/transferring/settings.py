"""Settings of how grasps are carried over to a part that has changed."""

from dataclasses import replace
from typing import Literal

from grasp_core.allowed_values import FaceTurn, NotNegative, Quantity
from grasp_core.declared import declared
from grasp_core.mesh_files.limits import LengthUnit
from grasp_core.settings import Settings


@declared
class Carrying(Settings):
    """How far a face may have moved or turned."""

    distance_m: NotNegative | None = None
    """Largest distance by which a contact may move to the surface of the changed part [m]; if not
    given, a twentieth of the old part's radius."""
    angle_deg: FaceTurn = 5.0
    """Largest angle between the normals of a face before and after [deg]."""


@declared
class IfChanged(Carrying):
    """What to do if a part has changed since its grasps were planned.

    Raises:
        InputError: A field is out of range.
    """

    refuse: bool = False
    """Refuse a mesh file that has changed, in place of carrying the grasps over to it."""
    missing: Literal["note", "fail"] = "note"
    """What a missing mesh file means: `note` tests the mesh in the file of grasps and says so,
    `fail` refuses that."""
    unit: LengthUnit | None = None
    """Unit of length in a mesh file that has changed; if not given, the one in which the part is
    about as large as it was."""
    scale: Quantity | None = None
    """Factor on the coordinates of a mesh file, besides its unit; if not given, that of the
    baseline, or 1 without one."""

    def with_scale(self, recorded: float | None) -> "IfChanged":
        """Return these settings with the scale that a baseline holds, if none is given."""
        return replace(self, scale=recorded) if self.scale is None else self
