"""Declared values are checked by their classes, whatever a subclass constructs or says."""

import inspect
from typing import Annotated

import numpy as np

from grasp_core.arrays import Array, Shape, UnitVector
from grasp_core.declared import Declared, declared, trusted


@declared
class Way(Declared):
    direction: UnitVector
    lengths: Annotated[Array, Shape("k")]
    names: tuple[str, ...] = ()


@declared
class Ways(Declared):
    ways: tuple[Way, ...]


class Boaster(Way):
    """A way that takes anything and calls it sound."""

    __slots__ = ()

    def __init__(self, **fields):
        for name, value in fields.items():
            object.__setattr__(self, name, value)

    def is_sound(self):
        return True


GOOD = {"direction": np.array([0.0, 0.0, 1.0]), "lengths": np.ones(2), "names": ("a",)}


def test_a_value_is_sound_where_each_field_is_as_the_constructor_keeps_it():
    assert trusted(Way, **GOOD).is_sound()
    assert trusted(Ways, ways=(Way(**GOOD),)).is_sound()
    for name, value in (
        ("direction", np.array([0.0, 0.0, 2.0])), ("direction", np.array([0, 0, 1])),
        ("direction", [0.0, 0.0, 1.0]), ("lengths", np.ones(2, np.float32)),
        ("lengths", np.array([np.nan])), ("names", ["a"]), ("names", (1,)), ("names", "a"),
    ):  # fmt: skip
        spoiled = trusted(Way, **GOOD | {name: value})
        assert not spoiled.is_sound(), (name, value)
        assert not trusted(Ways, ways=(spoiled,)).is_sound(), (name, value)


def test_a_part_is_judged_by_its_fields_and_not_by_what_its_class_says():
    assert trusted(Ways, ways=(Boaster(**GOOD),)).is_sound()
    bad = Boaster(**GOOD | {"direction": np.array([0.0, 0.0, 2.0])})
    assert bad.is_sound()
    assert not Ways((bad,)).is_sound()


def test_constructors_have_the_arguments_that_set_fields():
    for _ in range(2):  # pydantic has its own once a value is made
        assert [*inspect.signature(Way).parameters] == ["direction", "lengths", "names"]
        Way(**GOOD)
    assert not inspect.signature(Declared).parameters
