"""Contacts on four bodies, decided as independent judges decide them."""

import math
from collections import Counter

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.closure import decision
from tests.grasp_core.bodies import BODIES, moved
from tests.judges import random_contacts
from tests.tampering import exact_closure

SETS = 50
"""Number of contact sets on each body."""
NEAR = 0.02
"""Margins this close to zero count as near the boundary of closure."""
COUNTS, SHARES = (2, 3, 4, 5, 6, 7), (0.05, 0.1, 0.6, 0.1, 0.08, 0.07)
"""How many contacts, and how often."""


def contact_set(rng, body):
    """Contacts as they lie on the body or, every other time, turned, scaled and moved."""
    positions, normals = BODIES[body](rng, int(rng.choice(COUNTS, p=SHARES)))
    if rng.uniform() < 0.5:
        return positions, normals
    return moved(rng, positions, normals, size=10.0 ** rng.uniform(-3, 3))


def some_friction(rng, count):
    """Any common friction, or a different one each, of which some are zero."""
    common = math.exp(rng.uniform(math.log(0.01), math.log(3.0)))
    if rng.uniform() < 0.8:
        return np.full(count, common)
    each = common * rng.uniform(0.5, 2.0, count)
    return np.where(rng.uniform(size=count) < 0.1, 0.0, each)


AT_LEAST = {"closed": 0.15, "open": 0.15, "barely": 0.1, "of several frictions": 0.1}
"""Shares of the contact sets of each body."""


@pytest.mark.parametrize("body", BODIES)
def test_contact_sets_are_decided_as_the_definition_decides_them(body):
    rng, seen = np.random.default_rng(1), Counter()
    for _ in range(SETS):
        positions, normals = contact_set(rng, body)
        friction = some_friction(rng, len(positions))
        certificate = gc.force_closure(positions, normals, friction)
        closed, margin = certificate.closed, certificate.margin
        assert certificate.verify()
        assert exact_closure.closure(certificate)
        assert not (closed and len(positions) == 2), "two contacts are on a line"
        if closed:
            optimum = exact_closure.margin_of(positions, normals, friction)
            assert margin == pytest.approx(optimum, rel=1e-6, abs=1e-7)
        seen["closed" if closed else "open"] += 1
        seen["barely"] += 0.0 < abs(margin) <= NEAR
        seen["of several frictions"] += bool(np.ptp(friction))
    assert all(seen[what] >= share * SETS for what, share in AT_LEAST.items()), seen


@pytest.mark.parametrize("margin", [0.01, -0.01])
def test_the_programs_answer_where_compiled_code_claims_what_it_cannot_prove(monkeypatch, margin):
    """Forces that do not balance, and twists that do not separate."""

    def lying(_, normals, *__):
        return normals + 0.1, np.ones((1, 6)), np.full((1, 2), margin)

    rng = np.random.default_rng(0)
    contacts = [(*random_contacts(rng, 5), 0.3) for _ in range(40)]
    expected = [gc.force_closure(*each).closed for each in contacts]
    monkeypatch.setattr(decision, "deepest_forces", lying)
    assert [gc.force_closure(*each).closed for each in contacts] == expected
    assert 8 <= sum(expected) <= 32
