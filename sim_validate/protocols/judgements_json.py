"""Writes `judgements.json`: what published tests, our trials and the analysis say of each grasp.

Each test stands in the file once, with all its numbers and sources. Numbers that JSON lacks are
null: the margin of a test without loads is infinite.
"""

from collections.abc import Iterable, Sequence
from dataclasses import asdict
from typing import Any, Literal, NotRequired, cast

from pydantic import ConfigDict, with_config
from typing_extensions import TypedDict

from grasp_core.files.json_text import text_of
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.provenance import versions
from sim_validate.hands.reaches_json import NotNegative
from sim_validate.kit.fields import Count, ObjectRecord, Positive, finite, object_record
from sim_validate.protocols.judging import Judgement


class RunRecord(TypedDict):
    """Fields about one run of a test."""

    number: Count
    passed: bool
    reason: str
    displacement_m: NotNegative | None
    turn_deg: NotNegative | None
    fingers: Count


class TheirsRecord(TypedDict):
    """Fields about the verdict of a published test."""

    passed: bool
    runs: list[RunRecord]


class OursRecord(TypedDict):
    """Fields about our verdict on the loads of a test."""

    held: bool
    force_closure: bool
    reason: str


class PredictedRecord(TypedDict):
    """Fields about what is predicted of the loads of a test."""

    resisted: bool
    margin: NotNegative | None
    """Least multiple of the loads that is resisted; null where nothing loads the object."""


class JudgementRecord(TypedDict):
    """Fields about one grasp and one test."""

    id: str
    hand: NotRequired[str]
    protocol: str
    mass_kg: Positive
    push_n: float
    theirs: TheirsRecord
    ours: OursRecord
    predicted: PredictedRecord


class TotalsRecord(TypedDict):
    """Numbers of grasps that were judged by one test."""

    grasps: Count
    theirs_passed: Count
    ours_held: Count
    predicted: Count
    agree: Count


@with_config(ConfigDict(strict=True, extra="forbid"))
class JudgementsFile(TypedDict):
    """The content of `judgements.json`."""

    schema: Literal[1]
    object: ObjectRecord
    friction: Positive
    complete: bool
    protocols: dict[str, dict[str, Any]]
    summary: dict[str, TotalsRecord]
    judgements: list[JudgementRecord]
    versions: dict[str, str]


def judgements_to_json(
    body: Polyhedron, friction: float, judgements: Iterable[Judgement], *, complete: bool
) -> str:
    """Write the text of `judgements.json`; equal judgements give equal texts."""
    listed = list(judgements)
    tests = {each.protocol.name: each.protocol for each in listed}
    document: JudgementsFile = {
        "schema": 1,
        "object": object_record(body),
        "friction": friction,
        "complete": complete,
        "protocols": {name: asdict(test) for name, test in tests.items()},
        "summary": judgements_summary(listed),
        "judgements": [_record(each) for each in listed],
        "versions": {**versions()},
    }
    return text_of(finite(document))


def judgements_summary(judgements: Sequence[Judgement]) -> dict[str, TotalsRecord]:
    """Count, for each test, grasps by their verdict, ours, and what was predicted."""
    named: dict[str, list[Judgement]] = {}
    for each in judgements:
        named.setdefault(each.protocol.name, []).append(each)
    return {
        name: {
            "grasps": len(found),
            "theirs_passed": sum(each.theirs for each in found),
            "ours_held": sum(each.ours.held for each in found),
            "predicted": sum(each.predicted for each in found),
            "agree": sum(each.theirs == each.ours.held for each in found),
        }
        for name, found in named.items()
    }


def _record(each: Judgement) -> JudgementRecord:
    record: JudgementRecord = {
        "id": each.grasp,
        "protocol": each.protocol.name,
        "mass_kg": each.mass_kg,
        "push_n": each.push_n,
        "theirs": {
            "passed": each.theirs,
            "runs": [cast("RunRecord", asdict(run)) for run in each.runs],
        },
        "ours": {
            "held": each.ours.held,
            "force_closure": each.ours.closed,
            "reason": each.ours.reason,
        },
        "predicted": {"resisted": each.predicted, "margin": each.ours.margin},
    }
    if each.hand:
        record["hand"] = each.hand
    return record
