import math

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.arrays import Shape, frozen, is_array, to_digits
from grasp_core.messages import UnfitError
from scenes.example_objects import example_object
from tests.tampering.changes import forged


def test_a_frozen_array_is_a_read_only_copy():
    source = np.arange(3.0)
    kept = frozen(source, (3,), "v")
    source[0] = 9.0
    assert kept[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        kept[0] = 1.0


@pytest.mark.parametrize("largest", [1.0, 0.05, 3.0, 1e-3, 120.0])
def test_numbers_apart_by_their_last_bits_are_rounded_to_the_same(largest):
    values = largest * np.array([1.0, -1.0, 0.5, 1 / 3, math.sqrt(0.5), 0.0, -1e-17])
    rounded = to_digits(values)
    for nudged in (np.nextafter(values, -np.inf), np.nextafter(values, np.inf)):
        np.testing.assert_array_equal(to_digits(nudged), rounded)
    np.testing.assert_allclose(rounded, values, rtol=0.0, atol=1e-8 * largest)
    assert not np.signbit(rounded[-2:]).any()


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
    assert is_array(np.zeros((2, 3), dtype=np.int64), None, 3, whole=True)
    for kind in (np.int8, np.int32, np.uint8, np.uint64, np.float64, bool):
        assert not is_array(np.zeros(3).astype(kind), 3, whole=True), kind
    assert not is_array(np.array(["0", "1"]), 2, whole=True)


@pytest.mark.parametrize("rows", [[[], 1.0], [[1.0], [1.0, 2.0]], [1.0, [None]]])
def test_rows_of_different_lengths_are_unfit(rows):
    with pytest.raises(UnfitError):
        Shape(None, nan=True).take(rows)


def test_lengths_that_overflow_are_no_units():
    assert not is_array(np.array([[300.0, 0.0, 0.0]], dtype=np.float16), 1, 3, units=True)
    assert not is_array(np.array([[1, 0, 0]], dtype=np.int8), 1, 3, units=True)


@pytest.mark.parametrize("kind", [np.float16, np.float32, np.int8, np.uint64, np.longdouble])
def test_certificates_with_other_types_are_none(kind):
    body = example_object("tetrahedron")
    grasp = gc.plan(body, 0.5, limit=1).grasps[0]
    quality = gc.ferrari_canny(grasp, friction=0.5, torque_scale=body.radius)
    assert quality.verify()
    for name in ("corners", "normals", "forces"):
        other = forged(quality.polytope, **{name: getattr(quality.polytope, name).astype(kind)})
        assert forged(quality, polytope=other).verify() is False
    wrenches = forged(quality.wrenches, G=quality.wrenches.G.astype(kind))
    assert forged(quality, wrenches=wrenches).verify() is False
    assert forged(quality, direction=quality.direction.astype(kind)).verify() is False


def test_normals_of_single_precision_are_taken_as_units():
    """They are the same as in double precision but for their own rounding."""
    unit = np.array([1.0, 2.0, 2.0]) / 3.0
    normals = np.array([-unit, -unit * [1, -1, 1], unit, unit * [1, -1, 1]])
    points = np.array([[3, 2, 0], [3, -2, 0], [-3, 2, 1], [-3, -2, -1]]) / 64.0
    single = normals.astype(np.float32)
    assert np.abs(np.linalg.norm(single.astype(float), axis=1) - 1.0).min() > 1e-8
    rounded = gc.force_closure(points.astype(np.float32), single, friction=0.9)
    exact = gc.force_closure(points, normals, friction=0.9)
    assert rounded.closed is exact.closed
    assert rounded.verify()
    assert np.abs(np.linalg.norm(rounded.normals, axis=1) - 1.0).max() < 1e-15
    assert not rounded.normals.flags.writeable
    contact = gc.Contact(points[0].astype(np.float32), single[0])
    assert contact.normal == pytest.approx(normals[0], abs=1e-7)
    with pytest.raises(gc.InputError, match="length 1"):
        gc.force_closure(points, 1.00001 * normals, friction=0.9)
