"""Negative controls: refuted by the analysis first, then let go by the simulator."""

import math
from collections import Counter
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import grasp_core as gc
import scenes
from grasp_core.families.regulus_kernel import LEAST_DEPTH
from sim_validate.closure.controls import (
    LOW_FRICTION,
    Control,
    negative_controls,
    try_control,
)
from sim_validate.engine.setup import Agenda, Setup
from sim_validate.engine.stepping import Bench
from tests.grasp_core.families.printed_paper import printed_regulus
from tests.grasp_core.quadruples import paired_quadruples
from tests.sim_validate.rigs import grasps

OBJECTS = ("tetrahedron", "wedge", "chamfered-box", "random-12-1", "l-bracket", "double-wedge-bar")
FRICTION = 0.17
"""Theta is 10 degrees."""
FAMILIES = ("concurrent", "pencil", "regulus", "free")


@cache
def all_controls():
    """With the object and the grasp that each was made from."""
    found = []
    for name in OBJECTS:
        body, planned = grasps(name, FRICTION, 2, FAMILIES)
        found += [
            (body, grasp, control)
            for grasp in planned
            for control in negative_controls(body, grasp, FRICTION, seed=1)
        ]
    return found


def test_the_simulator_lets_go_of_every_control_and_its_certificate_verifies():
    kinds = Counter()
    for body, _, control in all_controls():
        assert not control.certificate.closed
        assert control.certificate.verify()
        verdict = try_control(body, control, Agenda(), Setup())
        assert verdict.let_go, (control.name, [t.hold.outcome for t in verdict.tried])
        assert not verdict.held
        kinds[control.name] += 1
    assert sum(kinds.values()) >= 25
    assert set(kinds) == {"low_friction", "fingers_removed", "contacts_moved"}


def test_a_control_in_the_compiled_scene_of_its_grasp_is_that_of_its_own_to_the_last_bit():
    agenda, tried = Agenda(keep_traces=True), 0
    for body, grasp, control in all_controls():
        if control.name != LOW_FRICTION:
            continue
        bench = Bench(Setup().scene(body, grasp, FRICTION))
        alone = try_control(body, control, agenda, Setup())
        beside = try_control(body, control, agenda, Setup(), bench)
        for one, other in zip(alone.tried, beside.tried, strict=True):
            assert one.hold == other.hold
            np.testing.assert_array_equal(one.trace.gaps_m, other.trace.gaps_m)
            tried += len(one.trace.times_s) > 0
    assert tried >= 5


def test_moved_contacts_stay_on_their_faces_and_leave_their_regions():
    tested = 0
    for body, grasp, control in all_controls():
        if control.name != "contacts_moved":
            continue
        for face, contact in zip(grasp.faces, control.contacts, strict=True):
            plane = body.faces[face]
            assert abs((contact.position - plane.centroid) @ plane.normal) < 1e-9
        if grasp.radius > 0.0:
            moved = np.linalg.norm(
                [c.position - p for c, p in zip(control.contacts, grasp.positions, strict=True)],
                axis=1,
            )
            assert moved.max() > grasp.radius
        tested += 1
    assert tested >= 8


def test_grasps_that_no_three_fingers_lose_have_a_control_of_three_all_the_same():
    """With much friction any three fingers hold these; two, or none, would be a trivial control."""
    tested, body = 0, scenes.example_object("octahedron")
    for grasp in gc.plan(body, 0.8, limit=4, families=("concurrent", "regulus")).grasps:
        threes = [np.delete(np.arange(4), finger) for finger in range(4)]
        frictions = [
            gc.critical_friction(grasp.positions[rest], grasp.normals[rest]) for rest in threes
        ]
        if max(frictions) >= 0.8:
            continue
        known = replace(grasp, critical_friction=gc.critical_friction(grasp))
        (removed,) = [
            control for control in negative_controls(body, known, 0.8, seed=0)
            if control.name == "fingers_removed"
        ]  # fmt: skip
        assert len(removed.contacts) == 3
        assert removed.friction < 0.8
        assert removed.certificate.verify()
        assert try_control(body, removed, Agenda(), Setup()).let_go
        tested += 1
    assert tested >= 2


@pytest.mark.slow
def test_the_simulator_lets_go_of_what_the_printed_regulus_program_takes_for_grasps():
    body, theta, tested = scenes.example_object("random-30-1"), math.radians(10.0), 0
    for quad, cones in paired_quadruples(body.name, theta, 160):
        lines = printed_regulus(quad, cones, LEAST_DEPTH)
        if lines is None:
            continue
        places = body.center_of_mass + body.radius * lines.positions
        contacts = tuple(map(gc.Contact, places, [piece.normal for piece in quad]))
        proof = gc.force_closure(contacts, friction=math.tan(theta))
        if not proof.closed:
            control = Control("printed", math.tan(theta), proof)
            assert try_control(body, control, Agenda(), Setup()).let_go
            tested += 1
    assert tested >= 3
