"""Numbers and poses are taken from whatever a field holds, and nothing else is."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from grasp_core.errors import InputError
from sim_validate.judge.formats.fields import Source, depth, entry, numbers, pose, scale, text
from sim_validate.judge.records import BadRecord
from tests.sim_validate.judge.recorded import random_pose, seven


@pytest.mark.parametrize(
    "value",
    [[1, 2.0, 3], (1.0, 2.0, 3.0), np.array([[1.0, 2.0, 3.0]], ">f4"), [[1], [2, 3]],
     np.array([1, 2, 3], np.int8), [np.array([1.0, 2.0]), 3]],
    ids=str,
)  # fmt: skip
def test_numbers_are_a_row(value):
    assert numbers(value, "x").tolist() == [1.0, 2.0, 3.0]


laughs = ["ha"]
for _ in range(40):
    laughs = [laughs] * 40


@pytest.mark.parametrize(
    "value",
    [None, "1.0", ["1.0"], True, [1.0, True], [], {}, [[[1.0]]], np.array([True]), laughs,
     [laughs] * 500, np.zeros(1001), [0.0] * 1001, float("nan"), [1.0, float("inf")], 1e10,
     10**400, np.array([np.nan], np.float32), [["x" * 10**6] * 900] * 900],
    ids=lambda value: str(type(value)),
)  # fmt: skip
def test_anything_else_is_refused(value):
    with pytest.raises(InputError, match=r"^x ") as caught:
        numbers(value, "x")
    assert len(str(caught.value)) < 200


def test_a_pose_is_a_matrix_or_a_position_and_a_quaternion():
    rng = np.random.default_rng(0)
    for _ in range(20):
        wanted = random_pose(rng)
        for given in (wanted, wanted.astype(np.float32), wanted.ravel(), wanted.tolist(),
                      seven(wanted), seven(wanted).astype(np.float32)):  # fmt: skip
            found = pose(given, "p")
            assert found == pytest.approx(wanted, abs=1e-6)
            assert found[:3, :3] @ found[:3, :3].T == pytest.approx(np.eye(3), abs=1e-14)


@pytest.mark.parametrize(
    "value",
    [np.zeros(7), [0, 0, 0, 1.01, 0, 0, 0], [0, 0, 0, 0, 0, 0, 0.9], np.zeros(6), np.zeros((4, 4)),
     np.diag([1, 1, -1, 1]), np.diag([1.01, 1, 1, 1]), np.eye(4).T[[0, 1, 3, 2]],
     np.eye(4) + np.outer([0, 0, 0, 1], [1, 0, 0, 0])],
    ids=lambda value: str(np.array(value).tolist()),
)  # fmt: skip
def test_what_is_no_pose_is_refused(value):
    with pytest.raises(InputError, match=r"^p must"):
        pose(value, "p")


def test_the_order_of_a_quaternion_is_w_x_y_z():
    quarter = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    half = 0.5**0.5
    assert pose([1, 2, 3, half, 0, 0, half], "p")[:3, :3] == pytest.approx(quarter)
    assert pose([1, 2, 3, half, 0, 0, half], "p")[:3, 3].tolist() == [1.0, 2.0, 3.0]


def test_a_scale_is_one_number_or_three_equal_ones():
    assert scale(np.float32(0.25), "s") == scale([0.25] * 3, "s") == scale([[0.25]], "s") == 0.25
    for wrong in ([1.0, 1.0, 1.1], [1.0, 1.0], "1"):
        with pytest.raises(InputError, match=r"^s must"):
            scale(wrong, "s")


def test_a_field_that_is_not_there_is_named():
    for table in ({}, {"a": None}, [], None, 3):
        with pytest.raises(InputError, match="a"):
            entry(table, "a")
    with pytest.raises(InputError, match="a must be text"):
        text({"a": 1}, "a")


def test_indices_of_a_field_are_counted_up_to_two():
    values = (1.0, "abc", [], [1], ("a",), [[1]], [np.zeros(2)], np.zeros((2, 2, 2)), np.zeros(()))
    assert [*map(depth, values)] == [0, 0, 0, 1, 1, 2, 2, 2, 0]


def test_a_wrong_record_loses_only_itself(tmp_path):
    def make(item, name):
        if item == 1:
            raise InputError("wrong")
        return item, name

    found = list(Source(tmp_path, "f").records([0, 1, 2], 3, make))
    assert found == [(0, "f#0"), BadRecord("f#1", "wrong"), (2, "f#2")]
    assert list(Source(tmp_path, "f").records([7], 1, make)) == [(7, "f")]
    with pytest.raises(InputError, match="at most 100000"):
        next(Source(tmp_path, "f").records([], 100_001, make))
