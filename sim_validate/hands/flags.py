"""The flags that say with which hand grasps are to be reached, and which hand is to be shown.

This module imports nothing that is slow to load, so that help and usage errors answer at once.
"""

from dataclasses import field
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, UseAppendAction, arg

from grasp_core.declared import declared
from grasp_core.hands.settings import ReachSettings
from grasp_core.names import HANDS
from sim_validate.commands.flags import (
    BARE,
    AtFriction,
    FirstOnly,
    GraspId,
    GraspsPath,
    Jobs,
    Spoken,
)
from sim_validate.processes.workers import available_cores
from sim_validate.settings import HandTrials, ProtocolName

HandOrFile = Annotated[str, arg(help=f"The hand: {', '.join(HANDS)}, or an MJCF or URDF file.")]
FingertipNames = Annotated[str, arg(metavar="NAME,NAME,...", help=(
    "For a hand from a file: names of sites, geoms or bodies that are fingertips, separated by "
    "commas."
))]  # fmt: skip


@declared
class ShownHand(Spoken):
    """Flags of the command `hand`."""

    hand: Positional[HandOrFile]
    fingertips: FingertipNames = ""


@declared
class Reach(Spoken):
    """Flags of the command `reach`."""

    grasps: Positional[GraspsPath]
    hand: HandOrFile = "allegro"
    fingertips: FingertipNames = ""
    grasp: GraspId = None
    pose: Annotated[ReachSettings, BARE] = field(default_factory=ReachSettings)
    trials: Annotated[HandTrials, BARE] = field(default_factory=HandTrials)
    protocol: UseAppendAction[tuple[ProtocolName, ...]] = ()
    """With --simulate: judge the hand by the published test of another tool, beside our verdict
    under its loads and the predicted margin, and write judgements.json; may be repeated."""
    dexgraspbench: Path | None = None
    """Folder for records of DexGraspBench, one for each grasp that is reached, and for the object
    as it wants it, if that is convex."""
    friction: AtFriction = None
    limit: FirstOnly = None
    jobs: Jobs = field(default_factory=available_cores)
    out: Path | None = None
    """Folder for reaches.json, and for a picture of the nearest pose if a grasp is not reached; if
    not given, no file is written."""
