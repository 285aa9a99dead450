"""Judges sets of records: in units of work that any process can do, and that are resumed.

A unit is some records of one object at one scale. Its name is a hash of all that decides its
judgements: the records, the bytes of the object and the hand, the settings, and the versions of
everything. So what an interrupted command has finished counts exactly if it would come out the
same. What a unit gives is a `Judgements` of its own, and those of a set are put together of them.
"""

import hashlib
import json
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Self

from grasp_core.allowed_values import instance, path_of, several
from grasp_core.errors import InputError
from grasp_core.files.records import record_of
from grasp_core.files.text_files import write_text
from grasp_core.names import HANDS
from grasp_core.objects.convex_pieces import PiecedObject
from grasp_core.settings import as_table
from sim_validate.datasets.computing import UnitStaging, keep_result
from sim_validate.datasets.work_units import WorkerError, provenance
from sim_validate.judge.formats.reading import read_records
from sim_validate.judge.hands import JudgedHand, judged_hand
from sim_validate.judge.judging import Stage, judged_contacts
from sim_validate.judge.objects import object_files, recorded_object
from sim_validate.judge.records import BadRecord, ContactRecord, GraspRecord, HandRecord
from sim_validate.processes.own_faults import OWN_FAULTS
from sim_validate.protocols.published import PROTOCOLS
from sim_validate.protocols.settings import JudgeSettings
from sim_validate.protocols.verdict import Judgements, RecordedObject, RecordJudgement

UNIT_RECORDS = 25
"""Largest number of records in one unit, which take half a minute."""


@dataclass(frozen=True, slots=True)
class JudgeUnit:
    """Some records of one object at one scale, and how they are judged."""

    records: tuple[HandRecord | ContactRecord, ...]
    objects: Path
    """Where objects are looked for, absolute, or the name of a built-in object."""
    object_sha256: str
    """Hash of the object's files."""
    hand: str | None
    """The hand's file, absolute, or its name; None where there are only contacts."""
    hand_sha256: str
    """Hash of the hand's file and of those that it names."""
    settings: JudgeSettings

    @property
    def id(self) -> str:
        """Name of the unit: 32 hexadecimal digits, the same wherever the files lie."""
        decisive = [
            [[type(each).__name__, record_of(each)] for each in self.records], self.object_sha256,
            self.hand and Path(self.hand).stem, self.hand_sha256, as_table(self.settings),
            sorted(provenance().items()),
        ]  # fmt: skip
        return hashlib.sha256(json.dumps(decisive).encode()).hexdigest()[:32]

    def lost(self, reason: str) -> Judgements:
        """Say why no record of the unit can be judged."""
        return _judgements(None, self.settings, (), {each.id: reason for each in self.records}, ())


@dataclass(frozen=True, slots=True)
class RecordSet:
    """Records that are judged with one hand: units of work, and what cannot be judged at all."""

    hand: JudgedHand | None
    settings: JudgeSettings
    units: tuple[JudgeUnit, ...]
    """Units by object and scale."""
    unjudged: Mapping[str, str]
    """Why records cannot be judged, by their ids."""

    @classmethod
    def of(
        cls, records: Iterable[GraspRecord], hand: str | Path | None, objects: Path,
        settings: JudgeSettings,
    ) -> Self:  # fmt: skip
        """Split records into units.

        Raises:
            InputError: There is no record, the hand is refused, or records of a hand come without.
        """
        by_object = dict[tuple[str, float], list[HandRecord | ContactRecord]]()
        unjudged, units = dict[str, str](), list[JudgeUnit]()
        for each in records:
            if isinstance(each, BadRecord):
                unjudged[each.id] = each.reason
                continue
            if hand is None and isinstance(each, HandRecord):
                raise InputError(f"{each.id}: the record is of a hand; give that hand too (--hand)")
            by_object.setdefault((each.object, each.scale), []).append(each)
        if not by_object and not unjudged:
            raise InputError("there is no record to judge; give other files, or other filters")
        known = None if hand is None else judged_hand(hand)
        given = None if hand is None else str(hand if str(hand) in HANDS else Path(hand).resolve())
        place = objects.resolve() if objects.exists() else objects
        for (name, _), own in sorted(by_object.items()):
            try:
                source = object_files(name, place).sha256
            except InputError as error:
                unjudged |= {each.id: str(error) for each in own}
                continue
            units += [
                JudgeUnit(
                    tuple(own[first : first + UNIT_RECORDS]), place, source, given,
                    "" if known is None else known.sha256, settings,
                )
                for first in range(0, len(own), UNIT_RECORDS)
            ]  # fmt: skip
        return cls(known, settings, tuple(units), unjudged)

    def staged(self, ids: Sequence[str]) -> Iterator[tuple[Stage, HandRecord]]:
        """Yield records of a hand by their ids, each with its hand and object."""
        known = {each.id: (unit, each) for unit in self.units for each in unit.records}
        for unit, record in (known[name] for name in ids):
            if isinstance(record, HandRecord) and self.hand is not None:
                thing = recorded_object(record.object, record.scale, unit.objects)
                yield Stage(self.hand, thing, self.settings), record

    def together(self, parts: Iterable[Judgements]) -> Judgements:
        """Put the judgements of all units together."""
        records, objects = list[RecordJudgement](), dict[tuple[str, float], RecordedObject]()
        unjudged = dict(self.unjudged)
        for each in parts:
            records += each.records
            unjudged |= each.unjudged
            objects |= {(one.object, one.scale): one for one in each.objects}
        return _judgements(self.hand, self.settings, records, unjudged, [*objects.values()])


def _judgements(
    hand: JudgedHand | None, settings: JudgeSettings, records: Sequence[RecordJudgement],
    unjudged: Mapping[str, str], objects: Sequence[RecordedObject],
) -> Judgements:  # fmt: skip
    return Judgements(
        None, settings.friction, {name: PROTOCOLS[name] for name in settings.tests}, (),
        complete=not unjudged, records=tuple(records), unjudged=unjudged, asked=settings,
        hand=None if hand is None else hand.about, objects=tuple(objects),
    )  # fmt: skip


def judged_unit(unit: JudgeUnit) -> Judgements:
    """Judge the records of a unit; one that cannot be judged loses only itself.

    Raises:
        WorkerError: The object's files or the hand's have changed since the unit was made.
    """
    name, scale, settings = unit.records[0].object, unit.records[0].scale, unit.settings
    hand = None if unit.hand is None else _known_hand(unit.hand)
    if hand is not None and hand.sha256 != unit.hand_sha256:
        raise _changed(str(unit.hand))
    try:
        if object_files(name, unit.objects).sha256 != unit.object_sha256:
            raise _changed(name)
        thing = recorded_object(name, scale, unit.objects)
    except InputError as error:
        return unit.lost(str(error))
    of_hand = [each for each in unit.records if isinstance(each, HandRecord)]
    stage = Stage(hand, thing, settings) if hand is not None and of_hand else None
    by_hand = iter(() if stage is None else _judged(stage, of_hand))
    ends = {
        each.id: next(by_hand) if isinstance(each, HandRecord) else _alone(each, thing, settings)
        for each in unit.records
    }
    body = thing.body
    about = RecordedObject(
        name, scale, unit.object_sha256, body.content_sha256, body.center_of_mass, body.radius,
        body.notes,
    )  # fmt: skip
    return _judgements(
        hand, settings, [end for end in ends.values() if not isinstance(end, str)],
        {name: end for name, end in ends.items() if isinstance(end, str)}, [about],
    )  # fmt: skip


@lru_cache(maxsize=1)
def _known_hand(hand: str) -> JudgedHand:
    return judged_hand(hand)


def _changed(name: str) -> WorkerError:
    return WorkerError(f"{name}: this file has changed since the command began; start it again")


def _judged(stage: Stage, records: Sequence[HandRecord]) -> list[RecordJudgement | str]:
    """Judge records together, or one by one where some of them fails."""
    try:
        return stage.judged(records)
    except OWN_FAULTS as error:
        if len(records) == 1:
            return [str(error)]
        return [end for each in records for end in _judged(stage, [each])]


def _alone(
    record: ContactRecord, thing: PiecedObject, settings: JudgeSettings
) -> RecordJudgement | str:
    try:
        return judged_contacts(record, thing, settings)
    except OWN_FAULTS as error:
        return str(error)


@dataclass(frozen=True, slots=True)
class JudgedUnits:
    """A folder with the judgements of finished units, a file for each."""

    folder: Path

    def of(self, unit: JudgeUnit) -> Path:
        """Return the file of a unit."""
        return self.folder / f"{unit.id}.json"

    def write(self, unit: JudgeUnit, made: Judgements) -> None:
        """Keep the judgements of a unit."""
        write_text(self.of(unit), made.text())

    def quarantine(self, unit: JudgeUnit, reason: str) -> None:
        """Record why none of the records of a unit can be judged."""
        self.write(unit, unit.lost(reason))

    def read(self, unit: JudgeUnit) -> Judgements:
        """Read the judgements of a finished unit."""
        return Judgements.read(self.of(unit))

    def unfinished(self, units: Sequence[JudgeUnit]) -> list[JudgeUnit]:
        """List the units that no earlier command has finished, or whose file is damaged."""
        self.folder.mkdir(exist_ok=True)
        return [unit for unit in units if not self._is_finished(unit)]

    def _is_finished(self, unit: JudgeUnit) -> bool:
        try:
            return bool(self.read(unit))
        except (OSError, InputError):
            return False

    def remove(self) -> None:
        """Remove the folder, once a file holds all judgements."""
        shutil.rmtree(self.folder, ignore_errors=True)


def keep_judgements(unit: JudgeUnit, staging: UnitStaging[JudgeUnit]) -> None:
    """Judge the records of a unit and keep what comes out, or the reason why nothing does."""
    keep_result(unit, staging, judged_unit)


def judge_records(
    paths: Iterable[str | Path],
    hand: str | Path | None,
    objects: str | Path,
    settings: JudgeSettings | None = None,
    *,
    format: str | None = None,  # noqa: A002 - the word of users
) -> Judgements:
    """Judge recorded grasps, whoever made them.

    Args:
        paths: Files of records, and folders of such files.
        hand: The hand of the records: a built-in name, or an MJCF or URDF file. None for contacts
            alone.
        objects: Folder of the objects that records name; or one mesh file or built-in object.
        settings: Friction, published tests, and whether our own trial is run; None for the usual
            ones.
        format: Format of the files; None to recognise that of each.

    Returns:
        Contacts, proofs and verdicts of each record by object and scale, why others could not be
        judged, and a summary.

    Raises:
        InputError: A path, the hand, the format or a setting is refused, or there is no record.
    """
    listed = several(paths, lambda path: path_of(path, "paths"), "paths", "paths")
    usual = JudgeSettings() if settings is None else instance(settings, JudgeSettings, "settings")
    place, own = path_of(objects, "objects"), None if hand is None else path_of(hand, "hand")
    asked = RecordSet.of(read_records(listed, format, place), own, place, usual)
    return asked.together(map(judged_unit, asked.units))
