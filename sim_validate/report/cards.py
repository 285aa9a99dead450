"""Sorts the grasps of a run into cards, and draws a card: its pictures, its charts and its clips.

Any process can draw a card. Charts of motion need a trial: the first that was not held, or else the
weakest wrench, is simulated again.
"""

from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from grasp_core.closure.force_closure import force_closure
from grasp_core.errors import about
from grasp_core.files.text_files import write_text
from grasp_core.objects.standard_order import Copies, copies_of
from grasp_core.time_spent import TIME_SPENT
from scenes.drawing.clips import GraphicsError, write_trial_clip
from scenes.drawing.pictures import Drawing
from scenes.drawing.sheets import Sheet, svg_of
from scenes.settings import FingerSettings
from sim_validate.closure.replaying import WantedTrial, of_verdict, replayed
from sim_validate.closure.verdict import Verdict, Verdicts
from sim_validate.execution.execute import ExecutionJob
from sim_validate.execution.filming import film, worth_seeing
from sim_validate.execution.verdict import Executions
from sim_validate.files.results_folder import CLIP_FOLDER, GRASP_PAGES, PICTURE_FOLDER
from sim_validate.report.charts import margin_panels, motion_panels, wrench_panels
from sim_validate.report.run_folder import Findings, RunFolder, said_of_execution
from sim_validate.report.sections import said_of_reach


@dataclass(frozen=True, slots=True)
class FilmedTrial:
    """A clip of a trial of an execution."""

    path: str
    trial: str
    fate: str


@dataclass(slots=True)
class Drawn:
    """A grasp's charts as SVG text, and paths of its pictures relative to the report's folder."""

    picture: str
    hand: str = ""
    """Path of the picture with the hand in the grasp; empty if there is none."""
    nearest: str = ""
    """Path of the picture with the hand in the pose that came nearest; empty if there is none."""
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


@dataclass(frozen=True, slots=True, eq=False)
class Paged:
    """A grasp that has a page."""

    found: Findings
    name: str
    """Name of the files about it, which tells runs apart, too."""
    mirrored: bool
    """Whether only a reflection makes it from the grasp whose card it shares."""

    @property
    def id(self) -> str:
        """Id of the grasp."""
        return self.found.grasp.id

    @property
    def page(self) -> str:
        """Path of the grasp's page, relative to the report's folder."""
        return f"{GRASP_PAGES}/{self.name}.html"


@dataclass(frozen=True, slots=True, eq=False)
class Card(Paged):
    """A card in the gallery of the first page: a grasp, and its copies by symmetry."""

    script: str
    """Name of the script with the object's drawing."""
    clip: bool
    copies: tuple[Paged, ...]
    drawn: Drawn | None = None


def cards_of(run: RunFolder) -> tuple[Copies, ...]:
    """Sort the grasps of a run into cards: each is a grasp and those that symmetries make of it.

    Only grasps whose tests ended alike share a card, so that no problem is hidden behind another
    grasp.

    Gives places of the grasps in the run, by card, in the order of the cards' first grasps.
    """
    ended: dict[object, list[int]] = {}
    for place, found in enumerate(run):
        executed = said_of_execution(found.executed) if run.executions else None
        ended.setdefault((found.said, executed, said_of_reach(found)[0]), []).append(place)
    cards = list[Copies]()
    for places in ended.values():
        for card in copies_of(run.saved.body, [run.saved.grasps[place] for place in places]):
            rotated, mirrored = (
                tuple(places[each] for each in found) for found in (card.rotated, card.mirrored)
            )
            cards.append(Copies(places[card.first], rotated, mirrored))
    return tuple(sorted(cards, key=lambda card: card.first))


def cards_to_draw(runs: Sequence[RunFolder], clips: int) -> Iterator[Card]:
    """Yield the cards of runs, with clips of some of each run, those with problems first."""
    for number, run in enumerate(runs):
        prefix = f"{number}-" if len(runs) > 1 else ""
        paged = [Paged(found, f"{prefix}{found.grasp.id}", mirrored=False) for found in run]
        classes = cards_of(run)
        firsts = [paged[each.first] for each in classes]
        filmed = sorted(firsts, key=lambda each: not each.found.alarming)[:clips]
        for first, places in zip(firsts, classes, strict=True):
            copies = tuple(
                replace(paged[place], mirrored=place in places.mirrored)
                for place in places.places if place != places.first
            )  # fmt: skip
            script, clip = f"object-{number}.js", first in filmed
            yield Card(first.found, first.name, False, script, clip, copies)


@TIME_SPENT.on("files")
def draw(folder: Path, card: Card) -> Drawn:
    """Draw one grasp and write its pictures and charts to the folder of a report."""
    found = card.found
    drawing = Drawing(found.run.saved.body, found.shown, found.run.friction)
    view = drawing.view()
    drawn = Drawn(_picture(folder, card.name, drawing.sheet(view)))
    if (held := found.held) is not None:
        drawn.hand = _picture(folder, f"{card.name}-hand", replace(drawing, held=held).sheet())
    if (near := found.nearest) is not None:
        sheet = replace(drawing, held=near).sheet()
        drawn.nearest = _picture(folder, f"{card.name}-nearest", sheet)
    if force_closure(found.shown, friction=drawing.friction).closed:
        drawn.wrenches = tuple(map(svg_of, wrench_panels(drawing, view)))
        drawn.margins = tuple(map(svg_of, margin_panels(drawing, largest_push(found.verdict))))
    if found.verdict is not None and not found.verdict.not_simulated:
        _add_motion(drawn, found, found.verdict, folder / _clip(card) if card.clip else None)
    if card.clip and found.run.executions is not None:
        _add_executed(drawn, card, found.run.executions, folder)
    return drawn


def _picture(folder: Path, name: str, sheet: Sheet) -> str:
    path = f"{PICTURE_FOLDER}/{name}.svg"
    write_text(folder / path, svg_of(sheet, alone=True))
    return path


def _clip(card: Card, suffix: str = "") -> str:
    return f"{CLIP_FOLDER}/{card.name}{suffix}.webp"


@contextmanager
def _if_graphics(drawn: Drawn) -> Generator[None]:
    try:
        yield
    except GraphicsError as error:
        drawn.no_clip = str(error)


def _add_motion(drawn: Drawn, found: Findings, verdict: Verdict, clip: Path | None) -> None:
    run = found.run
    saved = replace(run.saved, friction=run.friction)
    recorded = of_verdict(run.path / Verdicts.FILE, saved, verdict, WantedTrial(found.grasp.id))
    trial = replayed(recorded, as_recorded=False)
    threshold = recorded.setup.hold.hold_threshold * trial.scene.layout.grasp_size_m
    drawn.motion = tuple(map(svg_of, motion_panels(trial, threshold)))
    drawn.trial, drawn.outcome = trial.name, trial.hold.outcome.value
    if clip is not None:
        with _if_graphics(drawn):
            name = f"{trial.name}: {drawn.outcome}"
            write_trial_clip(trial.scene, trial.watched.joints, clip, name)
            drawn.clip = f"{CLIP_FOLDER}/{clip.name}"


def _add_executed(drawn: Drawn, card: Card, executions: Executions, folder: Path) -> None:
    found, run = card.found.executed, card.found.run
    if found is None or found.execution is None:
        return
    used = found.execution.physics
    job = ExecutionJob(
        run.saved.body, card.found.grasp, executions.friction, executions.settings,
        {} if used is None else asdict(used),
    )  # fmt: skip
    filmed = list[FilmedTrial]()
    with _if_graphics(drawn), about(f"{run.path / Executions.FILE}: {found.id}"):
        for place, trial in enumerate(worth_seeing(found.execution)):
            path = _clip(card, f"-executed-{place}")
            film(job, trial.name, folder / path)
            filmed.append(FilmedTrial(path, trial.name, trial.fate))
        drawn.executed = tuple(filmed)


def largest_push(verdict: Verdict | None) -> float:
    """Look up the largest normal force that each finger may apply [N]."""
    if verdict is None:
        return FingerSettings().max_normal_force_n
    return verdict.setup.fingers.max_normal_force_n
