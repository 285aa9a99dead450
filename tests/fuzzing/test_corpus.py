"""Every seed and every input that fuzzing has found, read once more; and with one other value."""

import copy
import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import grasp_core as gc
from sim_validate.datasets.given_grasps import GraspToJudge, given_from_json, given_text
from tests.damaged import places, value_at
from tests.fuzzing.targets import targets

JSON_READERS = [name for name, target in targets().items() if target.written == "json"]
OTHER_NAMES = {
    "grasps": ("object", "grasp", "witness", "mesh", "MESH"),
    "contacts": ("contacts", "grasps"),
    "given": ("contacts", "grasp"),
    "baseline": ("grasps_file", "hold", "physics", "fingers", "noise", "wrench", "settings"),
    "wrenches": ("wrench",),
    "quarantine": ("line",),
}
"""What contradicts another field may be refused by the name of that one."""
SCALARS = st.one_of(
    st.none(), st.booleans(), st.integers(-(2**70), 2**70), st.floats(), st.text(max_size=20),
    st.sampled_from([[], {}, [1], {"a": 1}, "../x", "/etc/passwd", "\x1b[2J", -1, 0, 1e300]),
)  # fmt: skip
FEW = settings(max_examples=40, derandomize=True)


@pytest.mark.parametrize("name", targets())
def test_no_input_does_harm_and_what_is_whole_is_read(name):
    target = targets()[name]
    for said, data in target.inputs():
        try:
            accepted = target.check(data)
        except Exception as error:
            raise AssertionError(f"{name}: {said}: {error!r:.1000}") from error
        assert accepted or not said.startswith("seed"), said


@pytest.mark.parametrize("name", JSON_READERS)
def test_one_other_value_is_refused_by_name_or_read_as_it_is_now(name):
    target = targets()[name]
    text = next(iter(target.seeds())).decode()
    document = json.loads(text.split("\n")[0] if name == "quarantine" else text)
    ended = {"read": 0, "refused": 0}

    @FEW
    @given(st.sampled_from(list(places(document, ()))), SCALARS)
    def one(place, value):
        other = copy.deepcopy(document)
        value_at(other, place[:-1])[place[-1]] = value
        data = json.dumps(other).encode() + b"\n"
        try:
            found, refusal = target.read(data), ""
        except gc.InputError as error:
            refusal = str(error)
        ended["refused" if refusal else "read"] += 1
        if refusal:
            named = [part for part in place if isinstance(part, str) and part.isidentifier()]
            assert any(part in refusal for part in (*named, *OTHER_NAMES.get(name, ()))), refusal
        else:
            target.agrees(data, found)

    one()
    assert ended["refused"] > 5
    assert ended["read"] > 0


COORDINATES = st.integers(-(10**6), 10**6).map(lambda x: x / 7.0)
POINTS = st.lists(st.tuples(*[COORDINATES] * 3), min_size=4, max_size=4, unique=True)
NORMALS = ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.6, 0.8), (-1.0, 0.0, 0.0))


@FEW
@given(st.lists(POINTS, min_size=1, max_size=3))
def test_given_contacts_survive_their_text(listed):
    grasps = [GraspToJudge(f"given-{i:06}", f"n{i}", tuple(points), NORMALS)
              for i, points in enumerate(listed)]  # fmt: skip
    assert list(given_from_json(given_text(grasps))) == grasps
