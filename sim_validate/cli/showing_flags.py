"""The flags of the commands that show results: pictures of grasps and reports of runs.

This module imports nothing that is slow to load, so that help and usage errors answer at once.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from tyro.conf import OmitArgPrefixes, Positional

from grasp_core.checked import MOST_COUNT
from sim_validate.cli.flag_bounds import at_least, ends_in
from sim_validate.cli.flag_groups import Count, Friction, Speech
from sim_validate.parallel.processes import available_cores

PICTURES, CLIPS = (".svg", ".png"), (".gif", ".webp")
PAGES = (".html", ".htm")


@dataclass(frozen=True, slots=True)
class View:
    """Look at a grasp: in MuJoCo's viewer if there is a display, or in a file."""

    grasps: Positional[Path]
    """The grasps.json with the grasp to show, or the folder of a run."""
    grasp: str | None = None
    """Id of the grasp to show; if not given, the first one."""
    friction: Friction | None = None
    """Coulomb coefficient; if not given, the one planned for."""
    picture: Annotated[Path, ends_in(*PICTURES)] | None = None
    """Write the grasp as a picture like the paper's (svg, png)."""
    page: Annotated[Path, ends_in(*PAGES)] | None = None
    """Write a page (html) on which the grasp can be turned."""
    clip: Annotated[Path, ends_in(*CLIPS)] | None = None
    """Write a clip (webp, gif) of the fingers closing, which MuJoCo renders where there are
    graphics."""
    hand: bool = True
    """Show the hand of the reaches.json beside the grasps, where it reaches the grasp, in the
    picture and on the page."""
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)


@dataclass(frozen=True, slots=True)
class Report:
    """Write the results of a run as pages that open in a browser, without any network."""

    folder: Positional[Path]
    """Folder of a run, with its grasps.json; or a folder of such folders."""
    limit: Count | None = None
    """Draw only this many grasps per run, those with problems before others; if not given, all."""
    clips: Annotated[int, at_least(0, up_to=MOST_COUNT)] = 0
    """Number of grasps per run of which clips of trials are made, those with problems first, if
    graphics are available."""
    jobs: Count = field(default_factory=available_cores)
    """Largest number of processes."""
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)
    out: Path | None = None
    """Folder for the pages; if not given, `report` in the run's folder."""
