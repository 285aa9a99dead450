"""Draws one grasp: its picture and the charts of its page; any process can do the work.

Charts of motion need a trial: the first that was not held, or else the weakest wrench, is simulated
again.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from grasp_core.closure.force_closure import force_closure
from grasp_core.errors import about
from grasp_core.files.text_files import write_text
from grasp_core.planning.result import Plan
from grasp_core.values import Grasp
from scenes.drawing.clips import GraphicsError, write_trial_clip
from scenes.drawing.hands import PosedHand
from scenes.drawing.pictures import Drawing
from scenes.drawing.sheets import Sheet, svg_of
from scenes.settings import FingerSettings
from sim_validate.closure.replaying import Wanted, of_verdict, replayed
from sim_validate.closure.verdict import Verdict
from sim_validate.execution.execute import ExecutionJob, film, worth_seeing
from sim_validate.execution.verdict import Executions
from sim_validate.kit.files import CLIPS, PICTURES
from sim_validate.report.charts import margin_panels, motion_panels, wrench_panels
from sim_validate.report.run_folder import RunFolder
from sim_validate.report.sections import held_in


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """A grasp to draw, in a form that can be sent to another process."""

    saved: Plan
    """The object with the grasp alone, at the friction of the tests."""
    grasp: Grasp
    """The grasp, with its certified regions if it has any that may be drawn."""
    verdict: Verdict | None
    executions: Executions | None
    held: PosedHand | None
    """The hand in the grasp; None if there is none, or it does not reach the grasp."""
    source: Path
    """Path of the file with the verdict, which error messages name."""
    folder: Path
    name: str
    clip: bool


@dataclass(frozen=True, slots=True)
class FilmedTrial:
    """A clip of a trial of an execution."""

    path: str
    trial: str
    fate: str


@dataclass(frozen=True, slots=True)
class Drawn:
    """A grasp's charts as SVG text, and paths of its pictures relative to the report's folder."""

    picture: str
    hand: str = ""
    """Path of the picture with the hand in the grasp; empty if there is none."""
    wrenches: tuple[str, ...] = ()
    """Panels of the chart of wrenches; none if the contacts are not in force closure at this
    friction."""
    margins: tuple[str, ...] = ()
    motion: tuple[str, ...] = ()
    """Panels of the chart of motion; none if no trial was simulated."""
    clip: str | None = None
    trial: str = ""
    outcome: str = ""
    executed: tuple[FilmedTrial, ...] = ()
    no_clip: str = ""
    """Reason why no clip could be drawn; empty if there is a clip or none was asked for."""


def tasks_of(
    run: RunFolder, grasps: Sequence[Grasp], folder: Path, prefix: str, clips: int
) -> list[Task]:
    """List grasps of a run as tasks to draw, with clips of some, those with problems first."""
    filmed = {each.id for each in sorted(grasps, key=lambda each: not run.alarms(each.id))[:clips]}
    return [
        Task(
            saved=replace(run.saved, grasps=(grasp,), friction=run.friction),
            grasp=run.shown(grasp),
            verdict=run.verdict(grasp.id),
            executions=None
            if run.executions is None or (found := run.executed(grasp.id)) is None
            else replace(run.executions, grasps=(found,)),
            held=held_in(run.reaches, grasp),
            source=run.verdicts_path,
            folder=folder,
            name=f"{prefix}{grasp.id}",
            clip=grasp.id in filmed,
        )
        for grasp in grasps
    ]


def draw(task: Task) -> Drawn:
    """Draw one grasp and write its pictures and charts."""
    drawing = Drawing(task.saved.body, task.grasp, task.saved.friction)
    view = drawing.view()
    drawn = Drawn(_picture(task, drawing.sheet(view), ""))
    if task.held is not None:
        sheet = replace(drawing, held=task.held).sheet()
        drawn = replace(drawn, hand=_picture(task, sheet, "-hand"))
    if force_closure(task.grasp, friction=drawing.friction).closed:
        wrenches = wrench_panels(drawing, view)
        margins = margin_panels(drawing, largest_push(task.verdict))
        drawn = replace(
            drawn, wrenches=tuple(map(svg_of, wrenches)), margins=tuple(map(svg_of, margins))
        )
    if task.verdict is not None:
        drawn = _with_motion(task, task.verdict, drawn)
    return _with_executed(task, task.executions, drawn) if task.clip and task.executions else drawn


def _picture(task: Task, sheet: Sheet, suffix: str) -> str:
    path = f"{PICTURES}/{task.name}{suffix}.svg"
    write_text(task.folder / path, svg_of(sheet, alone=True))
    return path


def _with_motion(task: Task, verdict: Verdict, drawn: Drawn) -> Drawn:
    recorded = of_verdict(task.source, task.saved, verdict, Wanted(task.saved.grasps[0].id))
    found = replayed(recorded)
    size = found.scene.layout.grasp_size_m
    panels = motion_panels(found, recorded.setup.hold.hold_threshold * size)
    drawn = replace(
        drawn, motion=tuple(map(svg_of, panels)), trial=found.name, outcome=found.hold.outcome.value
    )
    if not task.clip:
        return drawn
    path = task.folder / CLIPS / f"{task.name}.webp"
    name = f"{found.name}: {drawn.outcome}"
    try:
        write_trial_clip(found.scene, found.watched.joints, path, name)
    except GraphicsError as error:
        return replace(drawn, no_clip=str(error))
    return replace(drawn, clip=f"{CLIPS}/{path.name}")


def _with_executed(task: Task, executions: Executions, drawn: Drawn) -> Drawn:
    (found,) = executions.grasps
    if found.execution is None:
        return drawn
    used = found.execution.physics
    job = ExecutionJob(
        task.saved.body, task.saved.grasps[0], executions.friction, executions.settings,
        {} if used is None else asdict(used),
    )  # fmt: skip
    filmed = list[FilmedTrial]()
    for place, trial in enumerate(worth_seeing(found.execution)):
        path = task.folder / CLIPS / f"{task.name}-executed-{place}.webp"
        try:
            with about(f"{task.source.with_name(Executions.FILE)}: {found.id}"):
                film(job, trial.name, path)
        except GraphicsError as error:
            return replace(drawn, no_clip=str(error))
        filmed.append(FilmedTrial(f"{CLIPS}/{path.name}", trial.name, trial.fate))
    return replace(drawn, executed=tuple(filmed))


def largest_push(verdict: Verdict | None) -> float:
    """Look up the largest normal force that each finger may apply [N]."""
    if verdict is None:
        return FingerSettings().max_normal_force_n
    return verdict.setup.fingers.max_normal_force_n
