"""Numbers, names and rotations as MJCF text."""

from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest

from scenes.mujoco.mjcf_text import (
    add_comment,
    add_element,
    document,
    element,
    printable,
    quaternion,
)
from tests.judges import random_rotation


def test_quaternions_are_those_of_mujoco():
    rng = np.random.default_rng(0)
    half_turns = [np.diag(signs) for signs in ([1.0, -1, -1], [-1.0, 1, -1], [-1.0, -1, 1])]
    for rotation in [np.eye(3), *half_turns, *(random_rotation(rng) for _ in range(100))]:
        found = quaternion(rotation)
        assert np.linalg.norm(found) == pytest.approx(1.0, abs=1e-15)
        assert found[np.abs(found).argmax()] > 0.0
        back = np.zeros(9)
        mujoco.mju_quat2Mat(back, found)
        assert back.reshape(3, 3) == pytest.approx(rotation, abs=1e-14)


def test_the_text_is_that_of_xml_etree():
    root, judge = element("a", {"name": 'x&y<z>"'}), ElementTree.Element("a", name='x&y<z>"')
    for parent, other in (
        (root, judge),
        (add_element(root, "b", {}), ElementTree.SubElement(judge, "b")),
    ):
        add_comment(parent, "for people")
        other.append(ElementTree.Comment(" for people "))
        add_element(parent, "c", {"size": 1.0 / 3.0, "axis": [[1, 2.0], [2.0**60, -1e-300]]})
        axis = "1.0 2.0 1.152921504606847e+18 -1e-300"
        ElementTree.SubElement(other, "c", size="0.3333333333333333", axis=axis)
    ElementTree.indent(judge)
    assert document(root) == ElementTree.tostring(judge, encoding="unicode") + "\n"


def test_names_can_be_printed():
    assert printable("a\n\x00b") == "a__b"
    assert printable("") == "object"
    assert printable("Äpfel 3") == "Äpfel 3"
