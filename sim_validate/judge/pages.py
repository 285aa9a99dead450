"""Writes the page about judged records: their numbers, pictures of some, and a table, worst first.

Drawn are the records that stand deepest in their objects, those that resist least of the ones in
force closure, and those of which a published test, our trial and the proof say different things.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, islice, zip_longest
from pathlib import Path
from typing import TypeAlias

from grasp_core.by_value import counted
from grasp_core.figures import NONE, figures
from grasp_core.files.file_kinds import JUDGEMENTS
from grasp_core.files.records import record_of
from grasp_core.messages import MILLI
from scenes.drawing.filed_hands import DEEP_M, filed_hand_sheet
from scenes.drawing.pages import (
    BAD_TONE,
    GOOD_TONE,
    TemplateData,
    facts_of,
    filled,
    records_table,
    text_of,
)
from scenes.drawing.sheets import night_style, svg_of
from scenes.mujoco.placed_shapes import placed_shapes
from sim_validate.engine.held_or_let_go import Outcome
from sim_validate.judge.judging import Stage
from sim_validate.judge.postures import placed
from sim_validate.judge.records import HandRecord
from sim_validate.judge.rows import TABLE_FILE
from sim_validate.protocols.verdict import (
    HandTrial,
    Judgements,
    RecordJudgement,
    TestOfRecord,
    TestTotals,
)

ASSETS = Path(__file__).parent / "assets"
MOST_PICTURES = 24
MOST_OF_WORST = 4
"""Largest number of the deepest records, and of those that resist least, that are drawn."""
MOST_ROWS = 300
COLUMNS = ("object", "closed", "contacts", "critical_friction", "depth_m")
FIGURES = {each.name: each for each in figures(RecordJudgement)}
WIDE = "name"
"""Class of cells that are broken into lines."""
Cell: TypeAlias = tuple[str, str]
"""What a cell says, with its class."""


@dataclass(frozen=True, slots=True)
class Drawn:
    """The picture of a record."""

    id: str
    picture: str
    """Text of an SVG element."""


def to_be_drawn(records: Sequence[RecordJudgement]) -> tuple[str, ...]:
    """Return the ids of the records of which a page has pictures, at most `MOST_PICTURES`."""
    by_turns = chain.from_iterable(zip_longest(*_groups(records).values()))
    return tuple(islice(dict.fromkeys(each.id for each in by_turns if each), MOST_PICTURES))


def drawn(stage: Stage, record: HandRecord) -> Drawn:
    """Draw the hand of a record at its object, as the record has both.

    Raises:
        InputError: The record has other joints than the hand.
    """
    at = placed(record, stage.filed).grasp
    near = stage.finder.stood(*at).contacts
    touching = [each for each in near if each.distance_m <= stage.settings.touch_m]
    name = f"The hand {stage.hand.name} in {record.id}, with {counted(len(touching), 'contact')}"
    sheet = filed_hand_sheet(placed_shapes(stage.filed, *at), touching, stage.body, name)
    return Drawn(record.id, svg_of(sheet))


def page(found: Judgements, drawn: Sequence[Drawn]) -> str:
    """Write the text of a page that needs no other file.

    Args:
        found: Judgements of recorded grasps.
        drawn: Pictures of those that `to_be_drawn` names.
    """
    records, totals = found.records, found.record_summary
    listed, unjudged = worst_first(records)[:MOST_ROWS], list(found.unjudged.items())
    names = dict.fromkeys(test.protocol for each in records for test in each.tests)
    places = {each.id: f"picture-{place}" for place, each in enumerate(drawn)}
    objects = len({each.object for each in records})
    return filled(
        "judgements.html",
        ASSETS,
        title="Judged grasps" if found.hand is None else f"Judged grasps of {found.hand.name}",
        said=f"{counted(len(records), 'record')} of {counted(objects, 'object')}, "
        f"{sum(each.good for each in records)} with nothing against them.",
        totals=[] if totals is None else [*facts_of(totals)],
        tests=[] if totals is None else records_table([*totals.tests.values()], TestTotals),
        groups=[*_figures(records, drawn, places)],
        deep_mm=f"{MILLI * DEEP_M:g}",
        columns=[*_columns([*names])],
        rows=[(each.id, places.get(each.id), _row(each, [*names])) for each in listed],
        cut=f"The worst are first. {_cut(len(listed), len(records), TABLE_FILE)}",
        unjudged=unjudged[:MOST_ROWS],
        unjudged_cut=_cut(min(len(unjudged), MOST_ROWS), len(unjudged), JUDGEMENTS),
        about=[*_about(found)],
        style=f"{text_of('style.css')}{night_style()}",
        script=text_of("tables.js"),
    )


def worst_first(records: Iterable[RecordJudgement]) -> list[RecordJudgement]:
    """Order records: those with most against them first, of these the deepest."""

    def against(each: RecordJudgement) -> int:
        return [each.closed, each.passed, each.held].count(False)

    return sorted(records, key=lambda each: (-against(each), -_depth_mm(each), each.id))


def _depth_mm(each: RecordJudgement) -> float:
    """Return the depth as pages show it, so that no digits decide that nobody sees."""
    return round(MILLI * (each.depth_m or 0.0), 2)


def _groups(records: Sequence[RecordJudgement]) -> Mapping[str, list[RecordJudgement]]:
    """Return the records of each heading under which some are drawn, in the order of drawing."""
    listed = worst_first(each for each in records if each.hand)
    deep = sorted((each for each in listed if _depth_mm(each) > 0.0), key=_depth_mm, reverse=True)
    weak = [(float(f"{each.weakest_n:.3g}"), each.id, each) for each in listed
            if each.closed and each.weakest_n is not None]  # fmt: skip
    return {
        "Deepest in the object": deep[:MOST_OF_WORST],
        "In force closure, and resist least": [each for *_, each in sorted(weak)[:MOST_OF_WORST]],
        "Pass a published test, and are proved to be open": [
            each for each in listed if any(map(_passes_open, each.tests))
        ],
        "Hold in our trial, and fail a published test": [
            each for each in listed if each.held and each.passed is False
        ],
        "Pass published tests, and do not hold in our trial": [
            each for each in listed if each.passed and each.held is False
        ],
    }


def _passes_open(test: TestOfRecord) -> bool:
    return test.passed and test.closed is False


def _figures(
    records: Sequence[RecordJudgement], drawn: Sequence[Drawn], places: Mapping[str, str]
) -> Iterable[TemplateData]:
    """Yield the headings with their pictures, and with those that earlier headings have."""
    pictures = {each.id: each.picture for each in drawn}
    for name, group in _groups(records).items():
        shown = [each for each in group if each.id in places]
        above = [(each.id, places[each.id]) for each in shown if each.id not in pictures]
        new = [
            {"id": each.id, "place": places[each.id], "picture": pictures.pop(each.id),
             "said": _said(each)}
            for each in shown if each.id in pictures
        ]  # fmt: skip
        count = f" ({len(shown)} of {len(group)})" if len(shown) < len(group) else ""
        if shown:
            yield {"heading": f"{name}{count}", "figures": new, "above": above}


def _said(each: RecordJudgement) -> list[Cell]:
    """Say in lines what was found of a record, below its picture."""
    closed = {True: "in force closure", False: "proved to be open", None: each.undecided}
    friction, depth = (FIGURES[name].cell(each) for name in ("critical_friction", "depth_m"))
    lines = [(f"{each.object}: {closed[each.closed]}", ""),
             (f"critical friction {friction}, {depth} mm deep", "")]  # fmt: skip
    answers = [(f"passes {test.protocol}", _of_test(test)) for test in each.tests]
    answers += [] if each.trial is None else [("holds ours", _of_trial(each.trial))]
    return [*lines, *((f"{asked}: {text}", tone) for asked, (text, tone) in answers)]


def _columns(tests: Sequence[str]) -> Iterable[Cell]:
    yield FIGURES["id"].shown.heading, FIGURES["id"].explained
    for name in COLUMNS:
        yield FIGURES[name].shown.heading, FIGURES[name].explained
    for name in tests:
        yield f"passes {name}", "Whether the grasp passes the published test, or why not."
    yield FIGURES["held"].shown.heading, FIGURES["held"].explained


def _row(each: RecordJudgement, tests: Sequence[str]) -> list[Cell]:
    closed = BAD_TONE if each.closed is False else ""
    tones = {"closed": closed, "object": WIDE}
    passed = {test.protocol: _of_test(test) for test in each.tests}
    told = [passed.get(name, (NONE, "")) for name in tests]
    told.append((NONE, "") if each.trial is None else _of_trial(each.trial))
    return [
        *((FIGURES[name].cell(each), tones.get(name, "")) for name in COLUMNS),
        *((text, f"{tone} {WIDE}") for text, tone in told),
    ]


def _of_test(test: TestOfRecord) -> Cell:
    """Say how a published test ended, and whether the proof is against it."""
    if test.passed:
        proved = ", but proved to be open at its friction"
        return (f"yes{proved}", BAD_TONE) if _passes_open(test) else ("yes", GOOD_TONE)
    reasons = [run.reason for run in test.runs if not run.passed] or ["no run"]
    return f"no, {reasons[0]}", BAD_TONE


def _of_trial(trial: HandTrial) -> Cell:
    """Say how our trial ended."""
    if not trial.held:
        return f"no, {trial.reason}", BAD_TONE
    loose = [each.name for each in trial.controls if each.outcome is Outcome.HELD]
    said = f"no, the control {loose[0]} held as well, so nothing is shown" if loose else "yes"
    return said, BAD_TONE if loose else GOOD_TONE


def _cut(shown: int, count: int, file: str) -> str:
    """Say how many rows a table has of how many."""
    if shown == count:
        return f"The table has {counted(count, 'row')}."
    return f"The table has {shown} of {count} rows; {file} has all."


def _about(found: Judgements) -> Iterable[Cell]:
    """Yield settings, how the hand differs from its file, and versions."""
    asked = found.asked
    settings = {} if asked is None else record_of(asked) | {"tests": ", ".join(asked.tests)}
    for name, value in settings.items():
        yield name, str(value)
    if found.hand is not None and found.hand.notes:
        yield found.hand.name, "; ".join(found.hand.notes)
    for name, version in found.versions.items():
        yield f"version of {name}", str(version)
