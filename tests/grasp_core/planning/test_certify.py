"""Figures that a planned grasp computes when they are asked for, and certificates of many."""

import copy
import pickle
from dataclasses import fields, replace
from functools import cache

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.planning import certify as module
from grasp_core.planning.certify import Candidate, certify_each, witness_faults
from grasp_core.planning.plan_search import PlanSearch
from grasp_core.planning.result import PlanRequest
from grasp_core.values import PUT_OFF
from scenes.example_objects import example_object

FRICTION = 0.4


@cache
def planned():
    return gc.plan(example_object("random-10-1"), FRICTION).grasps


def test_critical_frictions_found_together_are_those_found_one_by_one(monkeypatch):
    grasps = planned()
    alone = [grasp.critical_friction for grasp in grasps]
    assert len(set(alone)) > 20
    for grasp, friction in zip(grasps[::9], alone[::9], strict=True):
        assert friction == pytest.approx(min(gc.critical_friction(grasp), FRICTION), abs=2e-7)
    together = planned.__wrapped__()
    monkeypatch.delattr(module, "critical_friction")
    module.find_critical_frictions(together)
    assert [grasp.critical_friction for grasp in together] == alone


def _pickled(grasp):
    return pickle.loads(pickle.dumps(grasp))  # noqa: S301 - written here


@pytest.mark.parametrize("copied", [copy.deepcopy, replace, _pickled])
def test_copies_have_the_figures_of_the_original(copied):
    grasps = planned()
    for grasp in grasps[:2]:
        other = copied(grasp)
        for name in PUT_OFF:
            assert getattr(other, name) == getattr(grasp, name)
        assert other.id == grasp.id
        np.testing.assert_array_equal(other.positions, grasp.positions)


def test_planned_values_pass_the_checks_of_values_that_users_make():
    """They are made without checks, so here they are made once more with them."""
    grasps = planned()
    for grasp in grasps[::9]:
        for value in (grasp, grasp.witness, *grasp.contacts, *grasp.regions, *grasp.force_cones):
            checked = replace(value)
            for each in fields(value):
                one = getattr(value, each.name)
                if isinstance(one, np.ndarray):
                    assert not one.flags.writeable
                    assert one.dtype == np.float64
                    np.testing.assert_array_equal(one, getattr(checked, each.name))


def spoilt(one, kind):
    """Forces of a grasp as they are, too large, out of balance, or one outside its cone."""
    forces, normals = one.placement.forces.copy(), one.normals
    if kind == 1:
        return 2.0 * forces
    if kind == 2:
        forces += 1e-4 * normals[0]
    if kind == 3:
        forces[0] += np.linalg.norm(forces[0]) * np.cross(normals[0], [0.36, 0.48, 0.8])
    return forces / np.einsum("ki,ki->", forces, normals)


def test_candidates_with_faulty_witnesses_are_rejected():
    """Among them are lines of another family."""
    body = example_object("random-10-1")
    request = PlanRequest(FRICTION, ("concurrent", "pencil"))
    found = list(PlanSearch.of(body, request).run())
    candidates, sound = [], []
    for place, one in enumerate(found):
        placement = replace(one.placement, forces=spoilt(one, place % 4))
        family = one.family if place % 7 else "regulus"
        candidates.append(
            Candidate(one.id, one.faces, family, one.pieces, one.cones, placement, one.regions)
        )
        sound.append(place % 4 == 0 and family == one.family)
    contacts = (
        [(each.placement.positions, one.normals, each.placement.forces)
         for one, each in zip(found, candidates, strict=True)]
    )  # fmt: skip
    faults = witness_faults(
        *map(np.array, zip(*contacts, strict=True)), FRICTION, [each.family for each in candidates]
    )
    assert [fault is None for fault in faults] == sound
    certified = certify_each(candidates, FRICTION)
    assert [each is None for each in certified] == [fault is not None for fault in faults]
    assert len(set(faults)) >= 6
    assert sum(each is not None for each in certified) >= 20
