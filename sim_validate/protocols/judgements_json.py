"""Writes `judgements.json`: what published tests, our trials and the analysis say of each grasp.

Each test stands in the file once, with all its numbers and sources; a test that imitates another
simulator says so there and in each record. Numbers that JSON lacks are null: the margin of a test
without loads is infinite.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import Any, cast

from grasp_core.files.json_text import text_of
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.provenance import versions
from sim_validate.protocols.judgement import Judgement
from sim_validate.protocols.judgements_schema import (
    JudgementRecord,
    JudgementsFile,
    ProtocolRecord,
    RunRecord,
    TotalsRecord,
)
from sim_validate.protocols.published import PublishedProtocol
from sim_validate.records.fields import finite, object_record


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
        "protocols": {name: protocol_record(test) for name, test in tests.items()},
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


def protocol_record(protocol: PublishedProtocol) -> ProtocolRecord:
    """Return all numbers of a published test, with units in their names, and its sources."""
    own: Mapping[str, Any] = {**asdict(protocol), "physics": protocol.physics.record()}
    return cast("ProtocolRecord", {"imitation": protocol.imitation, **own})


def _record(each: Judgement) -> JudgementRecord:
    record: JudgementRecord = {
        "id": each.grasp,
        "protocol": each.protocol.name,
        "imitation": each.protocol.imitation,
        "mass_kg": each.mass_kg,
        "push_n": each.push_n,
        "theirs": {
            "passed": each.theirs,
            "copies_passed": each.copies_passed,
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
