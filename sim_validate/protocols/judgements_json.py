"""Writes `judgements.json`: what published tests, our trials and the analysis say of each grasp.

Each test stands in the file once, with all its numbers and sources; a test that imitates another
simulator says so there and in each record. Numbers that JSON lacks are null: the margin of a test
without loads is infinite.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

from grasp_core.files.json_text import text_of
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.provenance import versions
from sim_validate.protocols.judgement import Judgement
from sim_validate.protocols.published import PublishedProtocol
from sim_validate.records.verdicts_json import finite, object_record

SCHEMA = 1


def judgements_to_json(
    body: Polyhedron, friction: float, judgements: Iterable[Judgement], *, complete: bool
) -> str:
    """Write the text of `judgements.json`; equal judgements give equal texts.

    Args:
        body: The object.
        friction: Coulomb coefficient of our verdicts and of the predictions.
        judgements: The results, one for each grasp and test.
        complete: Whether every grasp that was asked for was judged.
    """
    listed = list(judgements)
    tests = {each.protocol.name: each.protocol for each in listed}
    document = {
        "schema": SCHEMA,
        "object": object_record(body),
        "friction": friction,
        "complete": complete,
        "protocols": {name: protocol_record(test) for name, test in tests.items()},
        "summary": judgements_summary(listed),
        "judgements": [_record(each) for each in listed],
        "versions": {**versions()},
    }
    return text_of(finite(document))


def judgements_summary(judgements: Sequence[Judgement]) -> dict[str, dict[str, int]]:
    """Count, for each test, grasps by their verdict, ours, and what was predicted."""
    counts: dict[str, Counter[str]] = {}
    for each in judgements:
        found = counts.setdefault(each.protocol.name, Counter(dict.fromkeys(COUNTED, 0)))
        yes = {"grasps": True, "theirs_passed": each.theirs, "ours_held": each.ours.held,
               "predicted": each.predicted, "agree": each.theirs == each.ours.held}  # fmt: skip
        found.update(name for name in COUNTED if yes[name])
    return {name: dict(found) for name, found in counts.items()}


COUNTED = ("grasps", "theirs_passed", "ours_held", "predicted", "agree")


def protocol_record(protocol: PublishedProtocol) -> Mapping[str, Any]:
    """Return all numbers of a published test, with units in their names, and its sources."""
    physics = protocol.physics.record()
    return {"imitation": protocol.imitation, **asdict(protocol), "physics": physics}


def _record(each: Judgement) -> Mapping[str, Any]:
    return {
        "id": each.grasp,
        **({"hand": each.hand} if each.hand else {}),
        "protocol": each.protocol.name,
        "imitation": each.protocol.imitation,
        "mass_kg": each.mass_kg,
        "push_n": each.push_n,
        "theirs": {
            "passed": each.theirs,
            "copies_passed": each.copies_passed,
            "runs": [asdict(run) for run in each.runs],
        },
        "ours": {
            "held": each.ours.held,
            "force_closure": each.ours.closed,
            "reason": each.ours.reason,
        },
        "predicted": {"resisted": each.predicted, "margin": each.ours.margin},
    }
