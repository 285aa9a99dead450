"""Reads what to do if the mesh file of a part has changed or is missing."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, cast

from grasp_core.checked import BOUNDS, number, one_of, positive, switch
from grasp_core.errors import InputError
from grasp_core.files.json_text import settings_of, shown
from grasp_core.objects.polyhedron import UNITS_M
from grasp_core.transferring.like_faces import ANGLE_DEG

NOTE, FAIL = "note", "fail"
TABLE = "changed_part"
"""Name of the table of `IfChanged` in a `*.grasps.toml` file."""


@dataclass(frozen=True, slots=True)
class IfChanged:
    """What to do if a part has changed since its grasps were planned.

    Raises:
        InputError: A field is out of range.
    """

    refuse: bool = False
    """Whether a changed part is refused; otherwise grasps are carried over to it."""
    missing: str = NOTE
    """What a missing mesh file means: `note` tests the mesh in the file of grasps and says so,
    `fail` refuses that."""
    unit: str | None = None
    """Unit of length of the mesh file; None for the one in which the part is about as large as it
    was."""
    scale: float | None = None
    """Factor on the coordinates of the mesh file, besides its unit; None for that of the baseline,
    or 1 without one."""
    distance_m: float | None = None
    """Largest distance by which a contact may move [m]; None for a twentieth of the part's radius.
    """
    angle_deg: float = ANGLE_DEG
    """Largest angle between the normals of a face before and after [deg]."""

    def __post_init__(self) -> None:
        switch(self.refuse, "refuse")
        one_of(self.missing, (NOTE, FAIL), "missing")
        if self.unit is not None:
            one_of(self.unit, UNITS_M, "unit")
        if self.scale is not None:
            positive(self.scale, "scale")
        if self.distance_m is not None:
            number(self.distance_m, "distance_m", least=0.0)
        number(self.angle_deg, "angle_deg", **BOUNDS["changed_by_deg"])

    def with_scale(self, recorded: float | None) -> "IfChanged":
        """Return these settings with the scale that a baseline holds, if none is given."""
        return replace(self, scale=recorded) if self.scale is None else self


CARRY = IfChanged()
KNOWN = tuple(each.name for each in fields(IfChanged))


def if_changed(table: object) -> IfChanged:
    """Read the table `[changed_part]` of a `*.grasps.toml` file, or the same given by a marker."""
    if not isinstance(table, Mapping):
        raise InputError(f"{TABLE}: expected a table of settings, got {shown(table)}")
    given = {**cast("Mapping[str, Any]", table)}
    for name in given:
        if name not in KNOWN:
            raise InputError(
                f"{TABLE}: no setting is named {shown(name)}; choose from {', '.join(KNOWN)}"
            )
    return settings_of(IfChanged, given, [TABLE])
