"""Runs the command that judges recorded grasps, and the one that checks datasets and judgements."""

import time
from collections.abc import Iterable, Iterator
from fnmatch import fnmatchcase
from itertools import islice
from typing import Any

from grasp_core.by_value import counted
from grasp_core.errors import InputError
from grasp_core.figures import Figure, cell, figures
from grasp_core.files.file_kinds import JUDGEMENTS, MANIFEST
from grasp_core.files.text_files import write_parts, write_text
from grasp_core.settings import extended
from sim_validate.commands.console import TABLE_ROWS, Reporter, say_cut, warn_of
from sim_validate.commands.exit_codes import Exit, FlagsError
from sim_validate.datasets.clusters import workers_of
from sim_validate.datasets.command import tell_faults, verify_dataset
from sim_validate.datasets.computing import compute_all
from sim_validate.datasets.flags import VerifyFlags
from sim_validate.datasets.parquet import pyarrow
from sim_validate.engine.kept_gates import checked
from sim_validate.files.output_folders import alone_in
from sim_validate.files.results_folder import remove_results
from sim_validate.judge.flags import JudgeFlags
from sim_validate.judge.formats.reading import read_records
from sim_validate.judge.known_grasp import KnownGrasp
from sim_validate.judge.pages import drawn, page, to_be_drawn
from sim_validate.judge.records import BadRecord, GraspRecord, HandRecord
from sim_validate.judge.rows import TABLE_FILE, rows_bytes
from sim_validate.judge.sets import JudgedUnits, RecordSet, keep_judgements
from sim_validate.judge.verifying import verify
from sim_validate.protocols.settings import JudgeSettings
from sim_validate.protocols.verdict import Judgements, RecordJudgement, RecordTotals

PAGE_FILE = "judgements.html"
STAGING_FOLDER = "judging"
"""Folder of finished units of work, which is there until the judgements are complete."""
SHOWN = ("id", "depth_m", "critical_friction", "closed", "contacts", "passed", "held")
"""Figures of a record that are printed; files have all."""


def judge_files(command: JudgeFlags, reporter: Reporter) -> int:
    """Judge recorded grasps, or go on where an interrupted command ended."""
    pyarrow()  # before any work, so that a missing library is named at once
    _refuse_inside(command)
    tests = {"tests": tuple(dict.fromkeys(command.test))} if command.test else {}
    settings = extended(JudgeSettings, command.judging, **tests)
    records = [*_chosen(read_records(command.records, command.format, command.objects), command)]
    of_hand = any(isinstance(each, HandRecord) for each in records)
    if of_hand and command.hand is None:
        raise FlagsError("the records are of a hand: give it with --hand too")
    asked = RecordSet.of(records, command.hand, command.objects, settings)
    for note in () if asked.hand is None else asked.hand.notes:
        reporter.detail(f"{command.hand}: {note}")
    if of_hand and settings.trial:
        checked(KnownGrasp.of(settings.setup, settings.friction))
    with alone_in(command.out):
        remove_results(command.out, JUDGEMENTS)
        for name in (TABLE_FILE, PAGE_FILE):
            (command.out / name).unlink(missing_ok=True)
        found = _judged(asked, command, reporter)
    _show(found, reporter)
    if not all(each.good for each in found.records):
        return Exit.NEGATIVE
    return Exit.PARTIAL if found.unjudged else Exit.GOOD


def _refuse_inside(command: JudgeFlags) -> None:
    """Refuse to write among the records, where a later command would read what was written."""
    for path in command.records:
        if command.out.resolve().is_relative_to(path.resolve()):
            raise InputError(
                f"{command.out}: the output folder is in {path}, which has the records; give "
                "another --out"
            )


def _chosen(records: Iterable[GraspRecord], command: JudgeFlags) -> Iterator[GraspRecord]:
    """Choose records by their ids and objects, and the first of them."""
    chosen = (
        each for each in records
        if fnmatchcase(each.id, command.only or "*") and (
            command.object is None
            or (not isinstance(each, BadRecord) and fnmatchcase(each.object, command.object))
        )
    )  # fmt: skip
    return islice(chosen, command.limit)


def _judged(asked: RecordSet, command: JudgeFlags, reporter: Reporter) -> Judgements:
    """Have units of work judged that no earlier command has finished, and write all judgements."""
    staging = JudgedUnits(command.out.resolve() / STAGING_FOLDER)
    left = staging.unfinished(asked.units)
    work, began = command.work, time.monotonic()
    workers = workers_of(work.engine, work.jobs, work.address)
    with reporter.progress("judging") as steps, workers as engine:
        compute_all(left, staging, engine, steps.update, work.timeout_s, keep_judgements)
    if count := sum(len(unit.records) for unit in left):
        each_s = (time.monotonic() - began) / count
        reporter.say(f"{counted(count, 'record')} judged now, {each_s:.2g} s each")
    found = asked.together(map(staging.read, asked.units))
    text = found.text()
    write_parts(command.out / TABLE_FILE, [rows_bytes(found.records)])
    path = write_text(command.out / JUDGEMENTS, text)
    write_text(command.out / PAGE_FILE, _page(asked, found))
    staging.remove()
    reporter.say(f"wrote {path}, and {TABLE_FILE} and {PAGE_FILE} beside it")
    reporter.text(text)
    return found


def _page(asked: RecordSet, found: Judgements) -> str:
    """Write the page about the records, with pictures of some."""
    return page(found, [drawn(*each) for each in asked.staged(to_be_drawn(found.records))])


def _show(found: Judgements, reporter: Reporter) -> None:
    """Show records, why some fail or could not be judged, and numbers of all."""
    shown = [each for each in figures(RecordJudgement) if each.name in SHOWN]
    rows = [[each.cell(record) for each in shown] for record in found.records[:TABLE_ROWS]]
    reporter.table("judged records", [each.shown.heading for each in shown], rows)
    say_cut(len(found.records), reporter)
    apart = sum(bool(each.hand) and not each.links for each in found.records)
    if 2 * apart > len(found.records):
        reporter.warn(
            f"the hand touches no object in {apart} of {len(found.records)} records: check that "
            "quaternions are in the order w, x, y, z, that lengths are metres, and the scale"
        )
    failed = [f"{each.id}: {_why(each)}" for each in found.records if not each.good]
    warn_of(failed, JUDGEMENTS, reporter)
    left_out = [f"{name}: not judged: {reason}" for name, reason in found.unjudged.items()]
    warn_of(left_out, JUDGEMENTS, reporter)
    totals = found.record_summary
    assert totals is not None  # noqa: S101 - records were asked for
    reporter.records("by published test", [*totals.tests.values()])
    untried = () if any(each.trial for each in found.records) else ("held", "untrusted")
    numbers = [(each.shown.heading, _number(each, totals)) for each in figures(RecordTotals)
               if each.name not in untried]  # fmt: skip
    reporter.table("in all", ("of all records", ""), numbers)


def _number(of: Figure, totals: RecordTotals) -> str:
    """Write a figure of all records; of quartiles, all three, also where they are equal."""
    value: Any = of.of(totals)
    parts: list[Any] = [*value] if isinstance(value, tuple) else [value]
    return ", ".join(cell(part, of.shown) for part in parts)


def _why(record: RecordJudgement) -> str:
    """Say the first reason why a record is not good."""
    if record.closed is False:
        return "the contacts are proved not to be in force closure"
    for test in record.tests:
        for run in test.runs:
            if not run.passed:
                return f"{test.protocol}: run {run.number}: {run.reason}"
    return f"our trial: {(record.trial and record.trial.reason) or 'a negative control held'}"


def verify_folder(command: VerifyFlags, reporter: Reporter) -> int:
    """Check a dataset, or the judgements of records, and list its faults."""
    judged = (command.dataset / JUDGEMENTS).is_file()
    if not judged or (command.dataset / MANIFEST).is_file():
        return verify_dataset(command, reporter)
    return tell_faults(command.dataset, verify(command.dataset), reporter)
