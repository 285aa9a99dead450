"""Whatever numbers and letters are handed in, there is an answer or a refusal of our own."""

import contextlib
import math
import pickle

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import grasp_core as gc
import scenes
from grasp_core.messages import FieldError
from tests.judges import TETRA_CENTERS, TETRA_NORMALS

WEIRD = [
    0.0, -0.0, 1.0, math.nan, math.inf, -math.inf, 1e300, -1e300, 1e-300, 5e-324, 1e49, 1e-49,
    1e-160,
]  # fmt: skip
ANY = st.one_of(st.sampled_from(WEIRD), st.floats(), st.floats(-2.0, 2.0))
FINITE = st.one_of(
    st.sampled_from([number for number in WEIRD if abs(number) < 1e50]), st.floats(-2.0, 2.0)
)
SHAPES = st.sampled_from([(2, 3), (3, 3), (4, 3)])
OF_CONTACTS = {
    "closure": lambda x, n: gc.force_closure(x, n, 0.5).verify(),
    "critical friction": gc.critical_friction,
    "min-weight": gc.min_weight,
    "hull volume": lambda x, n: gc.hull_volume(x, n, torque_scale=1.0),
    "quality": lambda x, n: gc.ferrari_canny(x, n, torque_scale=1.0, gap=0.1).verify(),
    "forces": lambda x, n: gc.contact_forces(x, n, 0.5, [0.0, 0.0, 1.0, 0.0, 0.0, 0.0]),
    "limits": lambda x, n: gc.wrench_limits(x, n, 0.5, np.eye(6)[:2], max_normal_force=1.0),
    "lines": gc.classify_lines,
    "singular value": lambda x, _: gc.smallest_singular_value(x, torque_scale=1.0),
}


def answered(ask, *arguments):
    """There is an answer, or a refusal of our own; anything else is raised."""
    with contextlib.suppress(gc.GraspError):
        ask(*arguments)


@pytest.mark.parametrize("what", OF_CONTACTS)
@settings(max_examples=25)
@given(shape=SHAPES, data=st.data())
def test_any_contacts_with_unit_normals_are_answered_or_refused(what, shape, data):
    points = data.draw(arrays(np.float64, shape, elements=FINITE))
    ways = data.draw(arrays(np.float64, shape, elements=st.floats(-1.0, 1.0)))
    lengths = np.linalg.norm(ways, axis=1, keepdims=True)
    assume(lengths.min() > 1e-3)
    answered(OF_CONTACTS[what], points, ways / lengths)


@settings(max_examples=30)
@given(wrench=arrays(np.float64, 6, elements=ANY), center=arrays(np.float64, 3, elements=ANY),
       most=ANY)  # fmt: skip
def test_any_wrench_center_and_limit_is_answered_or_refused(wrench, center, most):
    contacts = TETRA_CENTERS, TETRA_NORMALS, 0.5
    answered(lambda: gc.contact_forces(*contacts, wrench, center=center, normal_force=(0.0, most)))
    answered(lambda: gc.wrench_limits(*contacts, [wrench], max_normal_force=most,
                                      center=center))  # fmt: skip
    answered(lambda: gc.ferrari_canny(*contacts, center=center, torque_scale=most, gap=0.1))


@settings(max_examples=30)
@given(st.one_of(st.text(), st.from_regex(r"random-\w{1,4}-\w{1,3}", fullmatch=True)))
def test_any_name_of_an_object_is_answered_or_refused(name):
    answered(scenes.example_object, name)


GIVEN = {gc.MeshError: (gc.MeshRefusal.OPEN, "mended so"), FieldError: ("size_m", "is wrong")}


def test_errors_are_the_same_after_pickling():
    kinds, left = list[type[gc.GraspError]](), [gc.GraspError]
    while left:
        kinds.append(left[-1])
        left += left.pop().__subclasses__()
    for kind in kinds:
        given = GIVEN.get(kind, ("mended so",))
        error = kind(*given)
        again = pickle.loads(pickle.dumps(error))  # noqa: S301 - our own
        assert type(again) is kind
        assert (str(again), vars(again)) == (str(error), vars(error))
    assert len(kinds) > 3
