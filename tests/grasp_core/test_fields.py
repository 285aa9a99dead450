"""Fields of certificates are arrays of the types in which checks compute, or no fields at all."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.arrays import are_units, is_array, is_indices
from scenes.example_objects import example_object

OTHERS = [np.float16, np.float32, np.longdouble, np.int8, np.int32, np.int64, np.uint64, ">f8"]


def test_arrays_are_float64():
    assert is_array(np.zeros((2, 3)), 2, 3)
    assert is_array(np.zeros((2, 3)), None, 3)
    assert not is_array(np.zeros((2, 3)), 3, 2)
    assert not is_array(np.zeros((2, 3)), 6)
    assert not is_array([0.0, 1.0], 2)
    for kind in OTHERS:
        assert not is_array(np.zeros(3).astype(kind), 3), kind
    for bad in (np.nan, np.inf, -np.inf, 1e60, -1e60):
        assert not is_array(np.array([0.0, bad]), 2)


def test_indices_are_int64():
    assert is_indices(np.zeros((2, 3), dtype=np.int64), None, 3)
    for kind in (np.int8, np.int32, np.uint8, np.uint64, np.float64, bool):
        assert not is_indices(np.zeros(3).astype(kind), 3), kind


def test_entries_that_wrap_when_made_positive_are_no_small_ones():
    """The least whole number of a type is its own negative."""
    assert not is_array(np.array([-128], dtype=np.int8), 1)
    assert not is_array(np.array([np.iinfo(np.int64).min]), 1)


def test_lengths_that_overflow_are_no_units():
    assert not are_units(np.array([[300.0, 0.0, 0.0]], dtype=np.float16), 1, 3)
    assert not are_units(np.array([[1, 0, 0]], dtype=np.int8), 1, 3)


def test_arrays_that_hide_entries_are_no_fields():
    hidden = np.ma.masked_array([1.0, np.nan], mask=[False, True])
    assert not is_array(hidden, 2)


@pytest.mark.parametrize("kind", [np.float16, np.float32, np.int8, np.uint64, np.longdouble])
def test_certificates_with_other_types_are_none(kind):
    body = example_object("tetrahedron")
    grasp = gc.plan(body, 0.5, limit=1).grasps[0]
    quality = gc.ferrari_canny(grasp, friction=0.5, torque_scale=body.radius)
    assert quality.verify()
    for name in ("corners", "normals", "forces"):
        other = replace(quality.polytope, **{name: getattr(quality.polytope, name).astype(kind)})
        assert replace(quality, polytope=other).verify() is False
    wrenches = replace(quality.wrenches, G=quality.wrenches.G.astype(kind))
    assert replace(quality, wrenches=wrenches).verify() is False
    assert replace(quality, direction=quality.direction.astype(kind)).verify() is False
