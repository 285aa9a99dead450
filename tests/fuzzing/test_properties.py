"""One value of a file that is read becomes another: it is refused by name, or read as it is now."""

import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import grasp_core as gc
from sim_validate.datasets.units import GivenGrasp, given_from_json, given_text
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
FEW = settings(max_examples=60, derandomize=True)


def _places(document, trail=()):
    items = document.items() if isinstance(document, dict) else enumerate(document)
    for key, value in items:
        yield (*trail, key)
        if isinstance(value, dict | list):
            yield from _places(value, (*trail, key))


def _with(document, trail, value):
    if not trail:
        return value
    copy = document.copy()
    copy[trail[0]] = _with(document[trail[0]], trail[1:], value)
    return copy


def _read(target, data):
    """What is read, or why not."""
    try:
        return target.read(data), ""
    except gc.InputError as error:
        return None, str(error)


@pytest.mark.parametrize("name", JSON_READERS)
def test_one_other_value_is_refused_by_name_or_read(name):
    target = targets()[name]
    text = next(iter(target.seeds())).decode()
    document = json.loads(text.split("\n")[0] if name == "quarantine" else text)
    ended = {"read": 0, "refused": 0}

    @FEW
    @given(st.sampled_from(list(_places(document))), SCALARS)
    def one(trail, value):
        data = json.dumps(_with(document, trail, value)).encode() + b"\n"
        found, refusal = _read(target, data)
        ended["refused" if refusal else "read"] += 1
        if refusal:
            named = [*(part for part in trail if isinstance(part, str)), *OTHER_NAMES.get(name, ())]
            assert any(part.isidentifier() and part in refusal for part in named), refusal
        else:
            target.agrees(data, found)

    one()
    assert ended["refused"] > 5
    assert ended["read"] > 0


COORDINATES = st.integers(-(10**6), 10**6).map(lambda x: x / 7.0)
POINTS = st.lists(
    st.tuples(COORDINATES, COORDINATES, COORDINATES), min_size=4, max_size=4, unique=True
)
NORMALS = ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.6, 0.8), (-1.0, 0.0, 0.0))


@FEW
@given(st.lists(POINTS, min_size=1, max_size=3))
def test_given_contacts_survive_their_text(listed):
    grasps = [
        GivenGrasp(f"given-{i:06}", f"n{i}", tuple(points), NORMALS)
        for i, points in enumerate(listed)
    ]
    assert list(given_from_json(given_text(grasps))) == grasps
