"""Reads the folder of a run: its grasps, verdicts, executions, regions, and a hand's poses."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from grasp_core.closure.contacts import contacts_sha256
from grasp_core.errors import InputError, about
from grasp_core.files.json_text import record_of
from grasp_core.files.text_files import read_text
from grasp_core.planning.result import Plan
from sim_validate.closure.verdict import Verdict, Verdicts
from sim_validate.execution.verdict import ExecutedGrasp, Executions
from sim_validate.kit.result_folders import BEST, JUDGEMENTS, REACHES
from sim_validate.planning.best_json import BestFile, best_of
from sim_validate.planning.grasps_json import GRASPS, read_grasps
from sim_validate.planning.regions_json import REGIONS, RegionsFile, regions_file_of
from sim_validate.protocols.judgements_json import JudgementsFile
from sim_validate.report.agreement import BAD, Record, said_of

if TYPE_CHECKING:
    from sim_validate.hands.reaches_json import SavedReaches

Read = TypeVar("Read", RegionsFile, JudgementsFile, BestFile)
Results = TypeVar("Results", Verdicts, Executions)


@dataclass(frozen=True, slots=True, eq=False)
class RunFolder:
    """What `plan`, `validate`, `execute`, `regions` and `reach` have written into one folder."""

    path: Path
    saved: Plan
    friction: float
    """Friction at which the grasps were tested; if they were not, at which they were planned."""
    tested: Verdicts | None
    """Verdicts on the grasps; None if no grasp was tested."""
    regions: Mapping[str, Record]
    regions_friction: float | None
    executions: Executions | None
    """Grasps as a robot executes them; None if the file does not exist."""
    reaches: "SavedReaches | None" = None
    judgements: Record | None = None
    possible: BestFile | None = None
    left_out: int = 0
    """Number of grasps in the files that `saved` leaves out."""

    def first(self, limit: int | None) -> "RunFolder":
        """Keep some of the run's grasps, those with problems before others, and all verdicts."""
        grasps = self.saved.grasps
        if limit is None or len(grasps) <= limit:
            return self
        chosen = {
            grasp.id for grasp in sorted(grasps, key=lambda each: not self.alarms(each.id))[:limit]
        }
        kept = tuple(grasp for grasp in grasps if grasp.id in chosen)
        return replace(self, saved=replace(self.saved, grasps=kept), left_out=len(grasps) - limit)

    def alarms(self, name: str) -> bool:
        """Tell whether the verdict on a grasp is a problem, or its execution lost the object."""
        found = self.executed(name)
        lost = found is not None and not (found.survived and found.controls_let_go)
        return lost or said_of(self.verdicts.get(name))[1] == BAD

    def executed(self, name: str) -> ExecutedGrasp | None:
        """Return what the execution of a grasp found; None if the grasp was not executed."""
        grasps = () if self.executions is None else self.executions.grasps
        return next((each for each in grasps if each.id == name), None)

    @property
    def verdicts(self) -> Mapping[str, Verdict]:
        """Verdicts by the ids of the grasps; empty if no grasp was tested."""
        return {each.id: each for each in self.tested or ()}

    @property
    def shaded(self) -> Mapping[str, Record]:
        """Certified regions that may be drawn: those for the friction of the verdicts, or less."""
        enough = self.regions_friction is not None and self.regions_friction <= self.friction
        return self.regions if enough else {}

    @property
    def verdicts_path(self) -> Path:
        """Path of the verdicts, which error messages name."""
        return self.path / Verdicts.FILE


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
    saved = read_grasps(path / GRASPS)
    tried = _results(Verdicts, path, saved)
    certified = _read(path / REGIONS, regions_file_of, saved)
    judgements_of = partial(record_of, JudgementsFile, wanted=JUDGEMENTS, schema=1)
    regions: Sequence[Record] = [] if certified is None else certified["grasps"]
    return RunFolder(
        path=path,
        saved=saved,
        friction=saved.friction if tried is None else tried.friction,
        tested=tried,
        regions=_by_id(path / REGIONS, regions, saved),
        regions_friction=None if certified is None else certified["friction"],
        executions=_results(Executions, path, saved),
        reaches=reaches_beside(path / GRASPS, saved),
        judgements=_read(path / JUDGEMENTS, judgements_of, saved),
        possible=_read(path / BEST[0], best_of, saved),
    )


def reaches_beside(grasps: Path, saved: Plan) -> "SavedReaches | None":
    """Read where a hand stands in grasps from the folder of their file."""
    path = grasps.with_name(REACHES)
    if not path.is_file():
        return None
    from sim_validate.hands.reaches_json import read_reaches  # runs without a hand need none

    found, record = read_reaches(path)
    _check_object(path, record["object"]["content_sha256"], saved)
    _check_contacts(path, record["reaches"], saved)
    return found


def _by_id(path: Path, records: Sequence[Record], saved: Plan) -> Mapping[str, Record]:
    _check_contacts(path, records, saved)
    return {each["id"]: each for each in records}


def _check_contacts(path: Path, records: Sequence[Record], saved: Plan) -> None:
    """Refuse a file that lists a grasp twice, or with other contacts than its own."""
    contacts = {grasp.id: contacts_sha256(grasp.contacts) for grasp in saved.grasps}
    for each in records:
        if contacts.get(each["id"]) != each["contacts_sha256"]:
            raise InputError(
                f"{path}: the contacts of {each['id']} differ from those in {GRASPS} beside it, "
                f"or the grasp is not in that file: write {path.name} again, or remove it"
            )
    if len({each["id"] for each in records}) < len(records):
        raise InputError(
            f"{path}: the file has two records of one grasp; make {path.name} again with the "
            "command that wrote it"
        )


def _results(kind: type[Results], folder: Path, saved: Plan) -> Results | None:
    """Read results about the grasps of a run, if there are any."""
    path = folder / kind.FILE
    if not path.is_file():
        return None
    found = kind.read(path)
    _check_object(path, found.object_sha256, saved)
    listed = [{"id": each.id, "contacts_sha256": each.contacts_sha256} for each in found]
    _check_contacts(path, listed, saved)
    return found


def _read(path: Path, read: Callable[[str], Read], saved: Plan) -> Read | None:
    if not path.is_file():
        return None
    with about(path):
        found = read(read_text(path))
    _check_object(path, found["object"]["content_sha256"], saved)
    return found


def _check_object(path: Path, sha256: str, saved: Plan) -> None:
    if sha256 != saved.body.content_sha256:
        raise InputError(
            f"{path}: the file is about another object than {GRASPS} beside it; write it again, "
            "or remove it"
        )
