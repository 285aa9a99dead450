"""The flags that say with which hand grasps are to be reached, and which hand is to be shown.

This module imports nothing that is slow to load, so that help and usage errors answer at once.
"""

from dataclasses import field
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, UseAppendAction, arg

from grasp_core.declared import declared
from grasp_core.kinds import Direction, HandClearance, Quantity, Seed, Starts, TorqueLimit
from grasp_core.names import HANDS
from sim_validate.commands.flags import (
    AtFriction,
    FirstOnly,
    GraspId,
    GraspsFile,
    Jobs,
    ProtocolName,
    Spoken,
)
from sim_validate.processes.workers import available_cores

HandName = Annotated[str, arg(help=f"The hand: {', '.join(HANDS)}, or an MJCF or URDF file.")]
Fingertips = Annotated[str, arg(metavar="NAME,NAME,...", help=(
    "For a hand from a file: names of sites, geoms or bodies that are fingertips, separated by "
    "commas."
))]  # fmt: skip


@declared
class Hand(Spoken):
    """Flags of the command `hand`."""

    hand: Positional[HandName]
    fingertips: Fingertips = ""


@declared
class Reach(Spoken):
    """Flags of the command `reach`."""

    grasps: Positional[GraspsFile]
    hand: HandName = "allegro"
    fingertips: Fingertips = ""
    grasp: GraspId = None
    table: Annotated[Direction | None, arg(metavar="X Y Z")] = None
    """Downward direction in the object's frame: the object lies on a table across it, and the hand
    stays above the table."""
    contacts_only: bool = False
    """Touch the planned contacts themselves, not anywhere in the grasps' regions."""
    clearance_m: HandClearance = 5e-4
    """Least distance between all that must not touch [m]."""
    starts: Starts = 100
    """Largest number of starts for each grasp."""
    torque_limit_n_m: TorqueLimit | None = None
    """Torque limit of every joint [N m], instead of those of the hand."""
    simulate: bool = False
    """Hold test wrenches in simulation with the hand's links and motors, and try negative controls;
    every joint needs a torque limit."""
    mass_kg: Quantity | None = None
    """Mass of the object [kg], with which the hand also executes each grasp that it reaches, as
    `execute` does with fingertips on springs; every joint needs a torque limit."""
    protocol: UseAppendAction[tuple[ProtocolName, ...]] = ()
    """With --simulate: judge the hand by the published test of another tool, beside our verdict
    under its loads and the predicted margin, and write judgements.json; may be repeated."""
    dexgraspbench: Path | None = None
    """Folder for records of DexGraspBench, one for each grasp that is reached, and for the object
    as it wants it, if that is convex."""
    friction: AtFriction = None
    seed: Seed = 0
    """Seed of the postures from which the search starts."""
    limit: FirstOnly = None
    jobs: Jobs = field(default_factory=available_cores)
    out: Path | None = None
    """Folder for reaches.json; if not given, no file is written."""
