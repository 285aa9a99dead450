"""The compiled polytope beside that of qhull, its proofs, and what becomes of wrong ones."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.compiled import compiled
from grasp_core.quality import ferrari_canny as module
from grasp_core.quality.ferrari_canny import InnerPolytope
from tests.judges import TETRA_CENTERS, TETRA_NORMALS
from tests.tampering.changes import forged

CUBE = np.vstack([np.eye(3), -np.eye(3)])
CORNERS = np.array(list(itertools.product([-1.0, 1.0], repeat=3))) / np.sqrt(3.0)
NEAR = 1e-9


@pytest.mark.parametrize("norm", ["l1", "linf"])
@pytest.mark.parametrize("positions", [TETRA_CENTERS, CUBE, CORNERS])
def test_symmetric_contacts_with_ties_everywhere_are_proved(monkeypatch, positions, norm):
    normals = -positions / np.linalg.norm(positions, axis=1, keepdims=True)
    monkeypatch.setattr(module, "MOST_SIMPLICES", 8000)
    found = gc.ferrari_canny(positions, normals, 0.5, torque_scale=1.0, norm=norm)
    assert found.verify()
    assert found.upper >= found.lower >= 0.75 * found.upper > 0.0


def test_the_finest_gap_is_reached():
    found = gc.ferrari_canny(
        TETRA_CENTERS, TETRA_NORMALS, 0.3, torque_scale=1.0, gap=module.FINEST_QUALITY_GAP
    )
    assert found.upper - found.lower <= module.FINEST_QUALITY_GAP * found.upper
    assert found.verify()


def spoiled(status=None, change=None):
    """The kernel with another status or with other forces, corners, normals and direction."""
    kernel = compiled(module.QUALITY_KERNEL)

    def grow(*args):
        true_status, *answer = kernel.grow(*args)
        if change is not None:
            answer = change(*answer)
        return (true_status if status is None else getattr(kernel, status), *answer)

    return SimpleNamespace(**{**vars(kernel), "grow": grow})


WRONG_ANSWERS = {
    "fell apart": spoiled("BROKEN_HULL"),
    "called flat": spoiled("IN_A_PLANE", lambda f, c, n, y: (f[:0], c[:0], n[:0], 0.0 * y)),
    "called outside": spoiled("ZERO_OUTSIDE"),
    "a simplex is missing": spoiled(None, lambda f, c, n, y: (f, c[1:], n[1:], y)),
    "a simplex is doubled": spoiled(
        None, lambda f, c, n, y: (f, np.vstack([c, c[:1]]), np.vstack([n, n[:1]]), y)
    ),
    "a corner is another": spoiled(None, lambda f, c, n, y: (f, (c + (c == 3)) % len(f), n, y)),
    "no such corner": spoiled(None, lambda f, c, n, y: (f, c + 1, n, y)),
    "all is there twice": spoiled(
        None, lambda f, c, n, y: (f, np.vstack([c, c]), np.vstack([n, n]), y)
    ),
    "a normal points inward": spoiled(
        None, lambda f, c, n, y: (f, c, np.vstack([-n[:1], n[1:]]), y)
    ),
    "not numbers": spoiled(None, lambda f, c, n, y: (f, c, np.nan * n, y)),
}  # fmt: skip


@pytest.mark.parametrize("kernel", WRONG_ANSWERS.values(), ids=WRONG_ANSWERS.keys())
def test_wrong_polytopes_prove_nothing_and_the_bounds_stay_true(monkeypatch, kernel):
    contacts = TETRA_CENTERS, TETRA_NORMALS, 0.3
    expected = gc.ferrari_canny(*contacts, torque_scale=1.0)
    monkeypatch.setattr(module, "compiled", lambda _: kernel)
    found = gc.ferrari_canny(*contacts, torque_scale=1.0)
    assert found.polytope is None
    assert -NEAR <= found.lower <= 0.0
    assert expected.upper * (1.0 - module.QUALITY_GAP) <= found.upper
    assert found.verify()


def test_a_cross_polytope_proves_its_radius_and_nothing_once_zero_is_outside():
    """The hull of plus and minus the unit vectors."""
    signs = np.array(list(itertools.product([0, 1], repeat=6)))
    points = np.vstack([np.eye(6), -np.eye(6)])
    polytope = InnerPolytope(points, np.arange(6) + 6 * signs, (1.0 - 2.0 * signs) / np.sqrt(6.0))
    wrenches = WrenchSet(np.eye(6), np.ones(2), "l1")
    radius = pytest.approx(1.0 / np.sqrt(6.0), rel=1e-12)
    assert polytope.proved_radius(wrenches) == radius
    for normals in (3.0 * polytope.normals, 0.0 * polytope.normals, -polytope.normals):
        shown = radius if (normals * polytope.normals).sum() > 0.0 else -np.inf
        assert forged(polytope, normals=normals).proved_radius(wrenches) == shown
    for points in (polytope.forces + 2.0, np.nan * polytope.forces):
        assert forged(polytope, forces=points).proved_radius(wrenches) == -np.inf
    none = forged(polytope, corners=polytope.corners[:0], normals=polytope.normals[:0])
    assert none.proved_radius(wrenches) == -np.inf
