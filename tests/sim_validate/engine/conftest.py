"""Grasps in their scenes, made once for the tests of this room."""

import pytest

import scenes
from tests.sim_validate.rigs import grasps, rig_of


@pytest.fixture(scope="session")
def layout():
    """The arrangement of a grasp of the wedge."""
    body, (grasp, *_) = grasps("wedge", 0.5, 1)
    return scenes.build_scene(body, grasp, 0.5).layout


@pytest.fixture(scope="session")
def held():
    """An object, its grasp, and the object in that gentle grasp."""
    body, (grasp, *_) = grasps("random-12-1", 0.5, 1)
    return body, grasp, rig_of(body, grasp, 0.5)
