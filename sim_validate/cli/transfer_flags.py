"""The flags that say how grasps are carried over to a part that has changed.

This module imports nothing that is slow to load, so that help and usage errors answer at once.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from tyro.conf import OmitArgPrefixes, Positional, arg

from sim_validate.cli.flag_bounds import within
from sim_validate.cli.flag_groups import (
    Friction,
    Lengths,
    MeshLimits,
    NotNegative,
    Point,
    Speech,
)


@dataclass(frozen=True, slots=True)
class Carrying:
    """How far a face may have moved or turned."""

    distance_m: NotNegative | None = None
    """Largest distance by which a contact may move to the surface of the changed part [m]; if not
    given, a twentieth of the old part's radius."""
    angle_deg: Annotated[float, within("changed_by_deg")] = 5.0
    """Largest angle between the normals of a face before and after [deg]."""


@dataclass(frozen=True, slots=True)
class Transfer:
    """Carry grasps over to a part that has changed since they were planned, and judge them anew."""

    grasps: Positional[Path]
    """The grasps.json that was planned on the old part."""
    part: Positional[str]
    """The changed part, in the same frame: a mesh file (obj, stl, ply, off, glb) or the name of a
    built-in object."""
    carrying: OmitArgPrefixes[Carrying] = Carrying()
    friction: Friction | None = None
    """Coulomb coefficient to judge with, before and after; if not given, the one planned for."""
    lengths: OmitArgPrefixes[Lengths] = field(default_factory=Lengths)
    center_of_mass_m: Annotated[Point | None, arg(metavar="X Y Z")] = None
    """Centre of mass of the changed part in the file's frame, in metres; if not given, that of
    uniform density, or the old part's if that was given."""
    limits: OmitArgPrefixes[MeshLimits] = field(default_factory=MeshLimits)
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)
    out: Path | None = None
    """Folder for transfer.json and the grasps.json of the changed part; if not given, no file is
    written."""
