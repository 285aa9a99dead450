"""Reads the folder of a run, its grasps and all results, and says how tests of a grasp ended."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

from grasp_core.closure.contacts import contacts_sha256
from grasp_core.errors import InputError
from grasp_core.files.file_kinds import GRASPS, REACHES
from grasp_core.files.records import RecordFile
from grasp_core.grasp_tables import ById, Named
from grasp_core.planning.grasps_json import load_grasps
from grasp_core.planning.result import Plan
from grasp_core.values import Grasp
from scenes.drawing.hands import PosedHand, posed_hand
from scenes.drawing.pages import BAD_TONE, GOOD_TONE, QUIET_TONE
from sim_validate.closure.verdict import Verdict, Verdicts
from sim_validate.engine.held_or_let_go import LET_GO, Outcome
from sim_validate.execution.verdict import ExecutedGrasp, Executions
from sim_validate.planning.best import Best
from sim_validate.planning.regions import GraspRegions, Regions
from sim_validate.protocols.verdict import Judgements

if TYPE_CHECKING:
    from sim_validate.hands.reaches import ReachedGrasp, Reaches

File = TypeVar("File", bound=RecordFile)
Item = TypeVar("Item", bound=Named)


@dataclass(frozen=True, slots=True, eq=False)
class RunFolder:
    """What `plan`, `validate`, `execute`, `regions` and `reach` have written into one folder.

    What is None has no file. Iteration yields what there is about each grasp.
    """

    path: Path
    saved: Plan
    friction: float
    """Friction at which the grasps were tested; if they were not, at which they were planned."""
    tested: Verdicts | None = None
    certified: Regions | None = None
    executions: Executions | None = None
    reaches: "Reaches | None" = None
    judgements: Judgements | None = None
    possible: Best | None = None
    left_out: int = 0
    """Number of grasps in the files that `saved` leaves out."""

    def __iter__(self) -> "Iterator[Findings]":
        return map(self.of, self.saved.grasps)

    def of(self, grasp: Grasp) -> "Findings":
        """Return what there is about one grasp, without all that there is about others."""
        tested, executions, reaches = self.tested, self.executions, self.reaches
        alone = replace(
            self, saved=replace(self.saved, grasps=(grasp,)), judgements=None,
            tested=tested and tested[:0], executions=executions and executions[:0],
            reaches=reaches and reaches[:0], certified=self.certified and self.certified[:0],
        )  # fmt: skip
        return Findings(
            alone, grasp, _about(tested, grasp), _about(executions, grasp), _about(reaches, grasp),
            _about(self.certified, grasp),
        )  # fmt: skip

    def first(self, limit: int | None) -> "RunFolder":
        """Keep some of the run's grasps, those with problems before others, and all verdicts."""
        grasps = self.saved.grasps
        if limit is None or len(grasps) <= limit:
            return self
        found = sorted(self, key=lambda each: not each.alarming)[:limit]
        chosen = {each.grasp.id for each in found}
        kept = tuple(grasp for grasp in grasps if grasp.id in chosen)
        return replace(self, saved=replace(self.saved, grasps=kept), left_out=len(grasps) - limit)

    @property
    def shades(self) -> bool:
        """Whether certified regions may be drawn: they are for the friction of the verdicts."""
        return self.certified is not None and self.certified.friction <= self.friction


def _about(results: ById[Item] | None, grasp: Grasp) -> Item | None:
    return next((each for each in results or () if each.id == grasp.id), None)


@dataclass(frozen=True, slots=True, eq=False)
class Findings:
    """What a run found about one grasp; it is None where there is nothing."""

    run: RunFolder
    """The run with this grasp alone, and with files that say nothing about any."""
    grasp: Grasp
    verdict: Verdict | None
    executed: ExecutedGrasp | None
    reached: "ReachedGrasp | None"
    certified: GraspRegions | None

    @property
    def said(self) -> tuple[str, str]:
        """How its tests ended, in words, with the tone: good, bad or neither."""
        return said_of_both(self.verdict, self.run.executions, self.executed)

    @property
    def alarming(self) -> bool:
        """Whether its verdict is a problem, or its execution lost the object."""
        return self.said[1] == BAD_TONE

    @property
    def shown(self) -> Grasp:
        """The grasp with its certified regions, if it has any that may be drawn."""
        found = self.certified if self.run.shades else None
        regions = None if found is None else found.regions
        return replace(self.grasp, regions=regions) if regions else self.grasp

    @property
    def held(self) -> PosedHand | None:
        """The hand in the pose in which it stands in the grasp."""
        reaches, found = self.run.reaches, self.reached
        if reaches is None or found is None or not found.reach.reached:
            return None
        return posed_hand(reaches.hand, found.reach, self.grasp)

    @property
    def nearest(self) -> PosedHand | None:
        """The hand in the pose that came nearest to a grasp in which it does not stand."""
        reaches, found = self.run.reaches, self.reached
        if reaches is None or found is None or found.reach.nearest is None:
            return None
        return posed_hand(reaches.hand, found.reach, self.grasp)


def said_of(verdict: Verdict | None) -> tuple[str, str]:
    """Say in words what the verdict on a grasp is, and of which kind: good, bad or quiet."""
    if verdict is None:
        return "not validated", QUIET_TONE
    outcome = verdict.outcome.value.replace("_", " ")
    if verdict.outcome not in (Outcome.HELD, *LET_GO):
        return outcome, BAD_TONE
    if verdict.mismatches:
        return "contradicts the analysis", BAD_TONE
    if any(control.held for control in verdict.controls):
        return "a negative control held", BAD_TONE
    if not verdict.controls_let_go:
        return "a negative control is undecided", BAD_TONE
    return outcome, GOOD_TONE if verdict.held else BAD_TONE


def said_of_execution(found: ExecutedGrasp | None, *, brief: bool = False) -> tuple[str, str]:
    """Say in words how the execution of a grasp ended, with the tone: good, bad or neither."""
    if found is None:
        return "not executed", QUIET_TONE
    if found.execution is None:
        return "no squeeze", BAD_TONE
    if not found.controls_let_go:
        return "a negative control held", BAD_TONE
    if not found.execution.trials:
        return "no trial is possible", BAD_TONE
    if lost := found.execution.lost:
        trials = found.execution.trials
        return "lost" if brief else f"failed {len(lost)} of {len(trials)} trials", BAD_TONE
    return "survived", GOOD_TONE


def said_of_both(
    verdict: Verdict | None, executions: Executions | None, found: ExecutedGrasp | None
) -> tuple[str, str]:
    """Say in words how a grasp ended in the test of its closure and, if any was, in its execution.

    Gives the words, and the tone: good, bad or neither; bad if either ending is.
    """
    closure, tone = said_of(verdict)
    if executions is None:
        return closure, tone
    ended, other = said_of_execution(found, brief=True)
    tones = {tone, other}
    worst = next(each for each in (BAD_TONE, GOOD_TONE, QUIET_TONE) if each in tones)
    return f"closure: {closure}; execution: {ended}", worst


def folder_of(path: Path) -> Path:
    """Return the folder of a run, given by its own path or by that of its grasps.json."""
    return path.parent if path.name == GRASPS else path


def runs_in(folder: Path) -> tuple[RunFolder, ...]:
    """Read the run in a folder, or the runs in its subfolders."""
    folder = folder_of(folder)
    if not folder.is_dir():
        raise InputError(
            f"{folder}: expected the folder of a run; give one that `graspproof run` has written"
        )
    inside = [folder, *sorted(path for path in folder.iterdir() if path.is_dir())]
    found = [path for path in inside if (path / GRASPS).is_file()]
    if not found:
        raise InputError(
            f"{folder}: the folder has no {GRASPS}, and neither has a folder in it; `graspproof "
            f"run OBJECT --out {folder}` writes one"
        )
    own = found[0] == folder
    return tuple(_run(path) for path in (found[:1] if own else found))


def _run(path: Path) -> RunFolder:
    saved = load_grasps(path / GRASPS)
    tried = _read(path, Verdicts, saved)
    return RunFolder(
        path=path,
        saved=saved,
        friction=saved.friction if tried is None else tried.friction,
        tested=tried,
        certified=_read(path, Regions, saved),
        executions=_read(path, Executions, saved),
        reaches=reaches_beside(path, saved),
        judgements=_read(path, Judgements, saved),
        possible=_read(path, Best, saved),
    )


def reaches_beside(folder: Path, saved: Plan) -> "Reaches | None":
    """Read where a hand stands in the grasps of a folder."""
    if not (folder / REACHES).is_file():
        return None
    from sim_validate.hands.reaches import Reaches  # runs without a hand need none

    return _read(folder, Reaches, saved)


def _read(folder: Path, kind: type[File], saved: Plan) -> File | None:
    path = folder / kind.FILE
    if not path.is_file():
        return None
    found = kind.read(path)
    _check_about(path, found, saved)
    return found


def _check_about(path: Path, found: Any, saved: Plan) -> None:
    """Refuse a file about another object, or that lists a grasp twice or with other contacts."""
    if found.object is None or found.object.content_sha256 != saved.body.content_sha256:
        raise InputError(
            f"{path}: the file is about another object than {GRASPS} beside it; write it again, "
            "or remove it"
        )
    contacts = {grasp.id: contacts_sha256(grasp.contacts) for grasp in saved.grasps}
    listed: list[Any] = [*cast("Iterable[Any]", found)] if isinstance(found, Iterable) else []
    for each in listed:
        if contacts.get(each.id) != each.contacts_sha256:
            raise InputError(
                f"{path}: the contacts of {each.id} differ from those in {GRASPS} beside it, "
                f"or the grasp is not in that file: write {path.name} again, or remove it"
            )
    if len({each.id for each in listed}) < len(listed):
        raise InputError(
            f"{path}: the file has two records of one grasp; make {path.name} again with the "
            "command that wrote it"
        )
