"""Checks the judgements of recorded grasps against each other and against what is computed again.

Certificates are verified, and figures are computed again from the contacts. Published tests and our
trials are not run again: what they say has to follow from their runs and loads.
"""

import math
from collections.abc import Iterator
from itertools import chain, zip_longest
from pathlib import Path

from grasp_core.errors import InputError
from grasp_core.files.file_kinds import JUDGEMENTS
from grasp_core.quality.ferrari_canny import QUALITY_GAP
from grasp_core.values import Contact
from sim_validate.datasets.columns import ROUNDOFF
from sim_validate.datasets.parquet import opened_table
from sim_validate.engine.held_or_let_go import Outcome
from sim_validate.judge.judging import contact_figures, proved
from sim_validate.judge.rows import COLUMNS, TABLE, TABLE_FILE, rows_of
from sim_validate.protocols.published import PROTOCOLS, PublishedProtocol
from sim_validate.protocols.settings import JudgeSettings
from sim_validate.protocols.verdict import (
    HandTrial,
    Judgements,
    RecordedObject,
    RecordJudgement,
    TestOfRecord,
)

AGREES = {
    "critical_friction": 10.0 * ROUNDOFF, "ferrari_canny": QUALITY_GAP, "payload": QUALITY_GAP,
}  # fmt: skip
"""Share of a figure by which it may differ from what is computed again: its own accuracy."""


def verify(folder: Path) -> list[str]:
    """List what is wrong with the judgements in a folder, one line each; none if all is well."""
    faults = list[str]()
    try:
        found = Judgements.read(folder / JUDGEMENTS)
        if found.asked is not None and not found.records:
            faults.append(f"{JUDGEMENTS}: no record was judged, so there is nothing to check")
        faults += _faults(found)
        faults += _table_faults(folder / TABLE_FILE, found)
    except InputError as error:
        faults.append(str(error))
    return faults


def _table_faults(path: Path, found: Judgements) -> Iterator[str]:
    """Yield rows of the table that are not what the file of judgements says."""
    with opened_table(path, TABLE, COLUMNS) as table:
        rows = (row for batch in table.iter_batches() for row in batch.to_pylist())
        for row, record in zip_longest(rows, found.records):
            wanted = None if record is None else rows_of([record])[0]
            if row is None or wanted is None:
                yield (
                    f"{path.name}: the file has {'fewer' if row is None else 'more'} rows than "
                    f"{JUDGEMENTS} has records"
                )
                return
            yield from (
                f"{path.name}: {wanted['id']}: {name} is {row[name]}, but {value} in {JUDGEMENTS}"
                for name, value in wanted.items() if row[name] != value
            )  # fmt: skip


def _faults(found: Judgements) -> Iterator[str]:
    asked = found.asked
    if asked is None:
        yield f"{JUDGEMENTS}: the file is not of `judge`, whose files alone are checked"
        return
    if found.protocols != {name: PROTOCOLS[name] for name in asked.tests}:
        yield f"{JUDGEMENTS}: protocols are not the tests {', '.join(asked.tests)} as they are here"
    names = [*(each.id for each in found.records), *found.unjudged]
    if len({*names}) < len(names):
        yield f"{JUDGEMENTS}: a record is there twice"
    objects = {(each.object, each.scale): each for each in found.objects}
    for each in found.records:
        about = objects.get((each.object, each.scale))
        faults = ["objects lacks its object"] if about is None else chain(
            _proof_faults(each, asked, about), _test_faults(each, asked), _trial_faults(each, asked)
        )  # fmt: skip
        yield from (f"{each.id}: {fault}" for fault in faults)


def _proof_faults(
    record: RecordJudgement, asked: JudgeSettings, about: RecordedObject
) -> Iterator[str]:  # fmt: skip
    proof, stated = record.proof, {name: getattr(record, name) for name in AGREES}
    if proof is None:
        if not record.undecided or any(value is not None for value in stated.values()):
            yield "there is no proof, so there must be a reason for that, and no figure"
        return
    if not proof.verify() or (proof.friction != asked.friction).any():
        yield f"the certificate proves nothing at friction {asked.friction:g}"
        return
    if len(proof.positions) != record.contacts:
        yield f"the proof has {len(proof.positions)} contacts, but links names {record.contacts}"
    for name, value in contact_figures(proof, about.center_of_mass, about.radius_m).items():
        told = stated[name]
        if told is None and value in (None, math.inf):  # null in files
            continue
        if told is None or value is None or not _agree(told, value, AGREES[name]):
            yield f"{name} is {told}, but {value} by the contacts"


def _agree(told: float, value: float, share: float) -> bool:
    return math.isclose(told, value, rel_tol=share, abs_tol=ROUNDOFF)


def _test_faults(record: RecordJudgement, asked: JudgeSettings) -> Iterator[str]:
    if tuple(each.protocol for each in record.tests) != (asked.tests if record.hand else ()):
        yield f"tests are not {', '.join(asked.tests)}, which were asked for"
        return
    contacts = []
    if record.proof is not None:
        contacts = [*map(Contact, record.proof.positions, record.proof.normals)]
    for each in record.tests:
        protocol = PROTOCOLS[each.protocol]
        again = proved(contacts, protocol.friction) if contacts else ""
        if not isinstance(again, str) and each.closed is not again.closed:
            yield f"{each.protocol}: closed is {each.closed}, but {again.closed} by the contacts"
        yield from (f"{each.protocol}: {fault}" for fault in _run_faults(each, protocol))


def _run_faults(test: TestOfRecord, protocol: PublishedProtocol) -> Iterator[str]:
    passing, every = protocol.passing, len(protocol.runs)
    if [run.number for run in test.runs] not in ([*range(every)], [0][: not test.passed]):
        yield f"the runs are not the {every} of the test"
    for run in test.runs:
        within = (
            run.displacement_m < passing.most_m and run.turn_deg < passing.most_deg
            and run.fingers >= passing.fingers
        )  # fmt: skip
        if run.passed != (not run.reason) or (run.passed and not within):
            yield f"run {run.number}: passed is {run.passed}, which its figures and reason deny"


def _trial_faults(record: RecordJudgement, asked: JudgeSettings) -> Iterator[str]:
    trial: HandTrial | None = record.trial
    if (trial is not None) != (asked.trial and bool(record.hand)):
        yield "there must be a trial exactly where a hand was to be tried"
    if trial is None:
        return
    for each in (*trial.loads, *trial.controls):
        held = each.outcome is Outcome.HELD
        if held != (not each.reason) or (held and not math.isfinite(each.displacement_m)):
            yield f"trial: {each.name}: its reason denies the outcome {each.outcome.value}"
    if trial.held != (not trial.reason) or (trial.held and not trial.loads):
        yield f"trial: held is {trial.held}, which its reason and loads deny"
