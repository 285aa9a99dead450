import dataclasses
import json

import pytest

import grasp_core as gc
from sim_validate.baselines.baseline_file import baseline_from_json, baseline_to_json
from tests.sim_validate.baselines.test_comparing import BEFORE, ENTRY


def test_a_baseline_comes_back_and_has_a_line_for_each_grasp():
    other = dataclasses.replace(
        ENTRY, id="p", simulated_limit_n=None, simulated_critical_friction=None
    )
    baseline = dataclasses.replace(BEFORE, entries=(ENTRY, other))
    text = baseline_to_json(baseline)
    assert baseline_from_json(text, "b.json") == baseline
    assert baseline_to_json(baseline_from_json(text, "b.json")) == text
    lines = [line for line in text.splitlines() if '"contacts_sha256"' in line]
    assert len(lines) == 2
    assert [json.loads(line.strip().rstrip(","))["id"] for line in lines] == [ENTRY.id, "p"]


def spoiled(change):
    record = json.loads(baseline_to_json(BEFORE))
    change(record)
    return json.dumps(record)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "not JSON"),
        ("[]", "expected an object"),
        (spoiled(lambda r: r.update(schema=2)), "schema: expected 1"),
        (spoiled(lambda r: r.pop("friction")), "friction: is missing"),
        (spoiled(lambda r: r.update(taste=1)), "taste: is missing, or not known"),
        (spoiled(lambda r: r.update(grasps=[])), "grasps: expected a list"),
        (spoiled(lambda r: r.update(grasps=[1])), r"grasps\[0\]: expected id"),
        (spoiled(lambda r: r["grasps"][0].pop("id")), r"grasps\[0\]: expected id"),
        (spoiled(lambda r: r["grasps"][0].update(limit_n="3")), r"grasps\[0\]\.limit_n"),
        (spoiled(lambda r: r["grasps"][0].update(limit_n=None)), r"grasps\[0\]\.limit_n"),
        (spoiled(lambda r: r["grasps"][0].update(mismatches=True)), "mismatches: expected int"),
        (spoiled(lambda r: r["grasps"].append(r["grasps"][0])), "the same id"),
    ],
)
def test_what_is_no_baseline_is_refused_with_the_field(text, message):
    with pytest.raises(gc.InputError, match=message) as raised:
        baseline_from_json(text, "b.json")
    assert str(raised.value).startswith("b.json: ")
