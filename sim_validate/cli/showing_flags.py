"""Flags of the commands that show results: pictures of grasps, reports of runs.

Nothing heavy is imported here, so that help and usage errors answer at once.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from tyro.conf import OmitArgPrefixes, Positional

from sim_validate.cli.flag_bounds import at_least, ends_in
from sim_validate.cli.flag_groups import Count, Friction, Speech
from sim_validate.parallel.processes import available_cores

PICTURES, CLIPS = (".png", ".svg", ".pdf", ".webp", ".jpg", ".jpeg"), (".gif", ".webp")
PAGES = (".html", ".htm")


@dataclass(frozen=True, slots=True)
class View:
    """Look at a grasp: in MuJoCo's viewer where there is a display, or in a file."""

    grasps: Positional[Path]
    """A grasps.json, or the folder of a run."""
    grasp: str | None = None
    """Id of the grasp; the first one if not given."""
    friction: Friction | None = None
    """Coulomb coefficient; the one planned for if not given."""
    picture: Annotated[Path, ends_in(*PICTURES)] | None = None
    """Write the grasp as a picture like the paper's (png, svg, pdf, webp, jpg)."""
    page: Annotated[Path, ends_in(*PAGES)] | None = None
    """Write a page on which the grasp can be turned (html)."""
    clip: Annotated[Path, ends_in(*CLIPS)] | None = None
    """Write a clip (webp, gif) of the fingers closing, rendered by MuJoCo; without graphics it
    shows the picture turning."""
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)


@dataclass(frozen=True, slots=True)
class Report:
    """Write the results of a run as pages that open in a browser, without any network."""

    folder: Positional[Path]
    """Folder of a run, with its grasps.json; or a folder of such folders."""
    limit: Count | None = None
    """Draw only this many grasps per run, those with problems before others; all if not given."""
    clips: Annotated[int, at_least(0)] = 0
    """Number of grasps per run of which a trial is filmed, those with problems first, where
    graphics are available."""
    jobs: Count = field(default_factory=available_cores)
    """Largest number of processes."""
    speech: OmitArgPrefixes[Speech] = field(default_factory=Speech)
    out: Path | None = None
    """Folder for the pages; `report` in the run's folder if not given."""
