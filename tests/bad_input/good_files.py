"""Whole files of each kind, made by the program itself, for cases to spoil."""

from functools import cache

import grasp_core as gc
from grasp_core.records import plan_to_json
from scenes.objects import example_object


@cache
def grasps_text() -> str:
    """A grasps.json with one grasp of the tetrahedron."""
    body = example_object("tetrahedron")
    return plan_to_json(body, gc.plan(body, 0.5, limit=1))
