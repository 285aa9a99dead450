"""Closure by compiled code against the programs of the conic solver."""

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.closure import decision
from grasp_core.closure.contacts import unit_size
from grasp_core.closure.decision import _decided_by_programs, _decided_quickly
from grasp_core.closure.proofs import ContactCones, proves_closure, refutes_closure


def contact_sets(count=120, seed=0):
    """Three to twelve contacts on roundish objects."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        k = int(rng.integers(3, 13))
        points = rng.normal(size=(k, 3))
        normals = -points / np.linalg.norm(points, axis=1, keepdims=True)
        normals += 0.3 * rng.normal(size=(k, 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        arms, _, _ = unit_size(points)
        yield ContactCones.at(arms, normals, np.full(k, 10.0 ** rng.uniform(-2.0, 0.5)))


def degenerate_sets(count=120, seed=1):
    """Two contacts, contacts in a plane, and contacts that push alike."""
    rng = np.random.default_rng(seed)
    for place in range(count):
        kind = place % 4
        k = 2 if kind < 2 else int(rng.integers(3, 7))
        points, normals = rng.normal(size=(2, k, 3))
        if kind == 1:
            normals[:] = normals[0]
        elif kind == 2:
            points[:, 2] = normals[:, 2] = 0.0
        elif kind == 3:
            normals[:] = normals[0] + 1e-7 * normals
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        arms, _, _ = unit_size(points)
        yield ContactCones.at(arms, normals, np.full(k, 10.0 ** rng.uniform(-3.0, 3.0)))


def test_degenerate_contacts_have_the_margins_of_the_programs():
    closed = answered = 0
    for contacts in degenerate_sets():
        quick, slow = _decided_quickly(contacts), _decided_by_programs(contacts)
        if quick is None:
            continue
        answered += 1
        closed += quick.closed
        assert quick.closed or quick.margin <= 0.0
        if slow.closed is not None and np.isfinite(slow.margin):
            assert quick.closed == slow.closed
            scale = max(1.0, float(contacts.friction[0]))
            assert quick.margin == pytest.approx(slow.margin, rel=1e-5, abs=1e-7 * scale)
    assert answered >= 15


def test_compiled_code_answers_as_the_programs_do():
    seen = {True: 0, False: 0, None: 0}
    for contacts in contact_sets():
        quick, slow = _decided_quickly(contacts), _decided_by_programs(contacts)
        seen[quick and quick.closed] += 1
        if quick is None:
            continue
        assert quick.closed == slow.closed
        assert quick.margin == pytest.approx(slow.margin, rel=1e-6, abs=1e-8)
        if quick.closed:
            assert proves_closure(contacts, quick.forces)
        else:
            assert refutes_closure(contacts, quick.twist)
            np.testing.assert_allclose(quick.twist, slow.twist, rtol=1e-3, atol=1e-4)
    assert seen[True] >= 30
    assert seen[False] >= 30
    assert seen[None] <= 2


@pytest.mark.parametrize("margin", [0.01, -0.01])
def test_the_programs_answer_where_compiled_code_claims_what_it_cannot_prove(monkeypatch, margin):
    """Forces that do not balance, and twists that do not separate."""

    def lying(_, normals, *__):
        return normals + 0.1, np.ones((1, 6)), np.full((1, 2), margin)

    contacts = [(each.arms, each.inward, each.friction) for each in contact_sets(40)]
    expected = [gc.force_closure(*each).closed for each in contacts]
    monkeypatch.setattr(decision, "deepest_forces", lying)
    assert [gc.force_closure(*each).closed for each in contacts] == expected
    assert 8 <= sum(expected) <= 32


def test_frictions_that_differ_and_none_at_all_are_left_to_the_programs():
    cones = next(contact_sets())
    assert _decided_quickly(cones.at_friction(0.0)) is None
    friction = cones.friction.copy()
    friction[0] *= 1.1
    assert _decided_quickly(ContactCones.at(cones.arms, cones.inward, friction)) is None
