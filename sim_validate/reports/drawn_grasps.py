"""One grasp -> the pictures and charts of its page, in files; any process can do the work.

Charts of motion need a trial. The first trial that was not held, or else the weakest wrench, is
simulated again, which gives bit for bit what was judged, unless it was stopped then.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from grasp_core.closure.force_closure import force_closure
from grasp_core.records.grasps_json import SavedGrasps
from grasp_core.values import ContactRegion, Grasp, four
from scenes.drawing.canvas import write_figure
from scenes.drawing.clips import GraphicsError, magnified, write_clip
from scenes.drawing.pictures import grasp_figure
from scenes.drawing.views import best_view
from scenes.fingertips import FingerSettings
from sim_validate.files.stale_results import CHARTS, CLIPS, PICTURES
from sim_validate.replaying.from_verdicts import of_verdict
from sim_validate.replaying.recorded import Wanted
from sim_validate.replaying.replay import Replayed, replayed
from sim_validate.reports.agreement import Record
from sim_validate.reports.margin_charts import margin_figure
from sim_validate.reports.motion_charts import motion_figure
from sim_validate.reports.run_folder import RunFolder
from sim_validate.reports.wrench_charts import wrench_figure


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """A grasp to draw, as it is sent to a worker."""

    saved: SavedGrasps
    """The grasp alone, with its object."""
    friction: float
    verdict: Record | None
    regions: Record | None
    """Record of its certified regions, if any."""
    source: Path
    """Path of the file with the verdict, for messages."""
    folder: Path
    """Folder of the report."""
    name: str
    """Beginning of the names of the grasp's files."""
    clip: bool
    """Whether to draw a clip of the trial, too."""

    @property
    def grasp(self) -> Grasp:
        """The grasp, with its certified regions if there are any."""
        return certified(self.saved.grasps[0], self.regions)


@dataclass(frozen=True, slots=True)
class Drawn:
    """Paths of a grasp's files, relative to the report's folder, and what they show."""

    picture: str
    wrenches: str | None
    """Chart of wrenches; None for contacts that are not in force closure at this friction."""
    margins: str | None
    motion: str | None = None
    """Chart of motion; None where nothing was simulated."""
    clip: str | None = None
    trial: str = ""
    """Name of the trial's wrench."""
    outcome: str = ""
    no_clip: str = ""
    """Why a clip could not be drawn."""


def tasks_of(run: RunFolder, folder: Path, prefix: str, clips: int) -> list[Task]:
    """List what there is to draw of a run, with clips of some grasps, those with problems first."""
    grasps = run.saved.grasps
    filmed = {each.id for each in sorted(grasps, key=lambda each: not run.alarms(each.id))[:clips]}
    return [
        Task(
            saved=replace(run.saved, grasps=(grasp,), friction=run.friction),
            friction=run.friction,
            verdict=run.verdicts.get(grasp.id),
            regions=run.shaded.get(grasp.id),
            source=run.verdicts_path,
            folder=folder,
            name=f"{prefix}{grasp.id}",
            clip=grasp.id in filmed,
        )
        for grasp in grasps
    ]


def certified(grasp: Grasp, record: Record | None) -> Grasp:
    """Replace the regions of a grasp by those of a record, if it has any."""
    if record is None or record["regions"] is None:
        return grasp
    regions = [
        ContactRegion("certified", np.array(each["polygon_m"]), each["inscribed_radius_m"])
        for each in record["regions"]
    ]
    return replace(grasp, regions=four(regions))


def draw(task: Task) -> Drawn:
    """Write the files of one grasp.

    Raises:
        InputError: The verdict is about other contacts.
    """
    body, grasp = task.saved.body, task.grasp
    view = best_view(body, grasp)
    picture = _written(
        task, PICTURES, "", grasp_figure(body, grasp, task.friction, view=view, legend=False)
    )
    drawn = Drawn(picture, None, None)
    if force_closure(grasp, friction=task.friction).closed:
        largest = largest_push(task.verdict)
        wrenches = wrench_figure(body, grasp, task.friction, view=view)
        margins = margin_figure(body, grasp, task.friction, max_normal_force_n=largest)
        drawn = replace(
            drawn,
            wrenches=_written(task, CHARTS, "-wrenches", wrenches),
            margins=_written(task, CHARTS, "-margins", margins),
        )
    return drawn if task.verdict is None else _with_motion(task, task.verdict, drawn)


def _with_motion(task: Task, verdict: Record, drawn: Drawn) -> Drawn:
    recorded = of_verdict(task.source, task.saved, verdict, Wanted(task.saved.grasps[0].id))
    found = replayed(recorded)
    size = found.scene.layout.grasp_size_m
    figure = motion_figure(found, recorded.setup.hold.hold_threshold * size)
    drawn = replace(
        drawn,
        motion=_written(task, CHARTS, "-motion", figure),
        trial=found.name,
        outcome=found.hold.outcome.value,
    )
    return _with_clip(task, found, drawn) if task.clip else drawn


def _with_clip(task: Task, found: Replayed, drawn: Drawn) -> Drawn:
    path = task.folder / CLIPS / f"{task.name}.webp"
    known = np.isfinite(found.watched.joints).all(axis=1)
    if not known.any():
        return replace(drawn, no_clip=f"{task.name}: nothing finite to draw")
    joints, factor = magnified(found.watched.joints[known], found.scene)
    caption = f"{found.name}: {found.hold.outcome.value}, motion {factor:g} times as large"
    try:
        write_clip(found.scene, joints, path, caption)
    except GraphicsError as error:
        return replace(drawn, no_clip=str(error))
    return replace(drawn, clip=f"{CLIPS}/{path.name}")


def _written(task: Task, kind: str, ending: str, figure: Any) -> str:
    path = task.folder / kind / f"{task.name}{ending}.webp"
    write_figure(figure, path)
    return f"{kind}/{path.name}"


def largest_push(verdict: Record | None) -> float:
    """Largest normal force of each finger [N]."""
    if verdict is None:
        return FingerSettings().max_normal_force_n
    return float(verdict["settings"]["fingers"]["max_normal_force_n"])
