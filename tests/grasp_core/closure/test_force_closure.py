import json
import math

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.closure import force_closure as module
from grasp_core.closure.decision import Decision
from grasp_core.files.json_text import text_of
from grasp_core.files.records import from_record, record_of
from tests.judges import TETRA_CENTERS, TETRA_NORMALS, random_contacts
from tests.tampering.changes import forged


def test_face_centres_of_a_tetrahedron_are_closed_at_any_friction():
    for friction in (1e-3, 0.1, 0.5, 2.0):
        certificate = gc.force_closure(TETRA_CENTERS, TETRA_NORMALS, friction)
        assert certificate.closed
        assert certificate.verify()
        assert certificate.margin == pytest.approx(friction / 4, rel=1e-6)
    assert gc.critical_friction(TETRA_CENTERS, TETRA_NORMALS) == 0.0


QUARTER = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
MIRRORED = QUARTER * [1, 1, -1]
"""A quarter turn about z, and with a reflection across it: (x, y, z) -> (-y, x, -z)."""


def images(way, point, normal):
    turns = [np.linalg.matrix_power(way, k) for k in range(4)]
    return np.array([R @ point for R in turns]), np.array([R @ normal for R in turns])


def on_a_frustum(beta):
    return images(QUARTER, [1.0, 0, 0], [-math.cos(beta), 0, -math.sin(beta)])


def on_parallel_faces(a, h, w):
    """Two and two opposite contacts in one plane; a third pair of axes closes nothing."""
    positions = np.array([[-w / 2, a, 0], [-w / 2, -a, 0], [w / 2, h + a, 0], [w / 2, h - a, 0]])
    return positions, np.array([[1.0, 0, 0], [1, 0, 0], [-1, 0, 0], [-1, 0, 0]])


INWARD = [-1.0, 0, 0]
KNOWN = [(images(MIRRORED, [1.0, s, h], INWARD), s)  # on the sides of a box: |s| / rho
         for s, h in ((0.2, 0.3), (0.4, 0.0), (0.4, 0.7), (0.05, -0.5))]  # fmt: skip
KNOWN += [(on_a_frustum(beta), math.tan(beta)) for beta in np.radians([10.0, 20.0, 30.0])]
KNOWN += [(on_parallel_faces(0.2, 1, 2), 0.3), (on_parallel_faces(0.5, 0.8, 2), 0.0),
          (on_parallel_faces(0.1, 0.5, 1), 0.3)]  # fmt: skip


@pytest.mark.parametrize(("contacts", "expected"), KNOWN)
def test_critical_frictions_are_those_of_closed_forms(contacts, expected):
    assert gc.critical_friction(*contacts) == pytest.approx(expected, rel=1e-7, abs=1e-7)


@pytest.mark.parametrize(
    ("rho", "z1", "z2", "expected"), [(1.0, 0.0, 0.3, 0.2), (0.8, 0.2, -0.1, 0.166636)]
)
def test_sides_and_top_of_a_prism(rho, z1, z2, expected):
    angles = np.radians([90.0, 210.0, 330.0])
    out = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    positions = np.vstack(
        [rho * out + np.array([[0, 0, z1], [0, 0, z2], [0, 0, z2]]), [[0, 0, 1.0]]]
    )
    normals = np.vstack([-out, [[0, 0, -1.0]]])
    assert gc.critical_friction(positions, normals) == pytest.approx(expected, abs=1e-6)
    assert gc.critical_friction(positions[:3], normals[:3]) == pytest.approx(
        abs(z2 - z1) / (1.5 * rho)
    )


def test_contacts_on_one_line_are_never_closed():
    positions = np.array([[0.0, 0, z] for z in (-2, -1, 1, 2)])
    normals = np.array([[0.0, 0, 1], [0, 0, 1], [0, 0, -1], [0, 0, -1]])
    certificate = gc.force_closure(positions, normals, 0.9)
    assert not certificate.closed
    assert certificate.verify()
    assert gc.critical_friction(positions, normals) == math.inf


def test_contacts_from_one_side_have_a_margin_that_a_file_can_hold():
    normals = np.tile([0.0, 0.0, -1.0], (3, 1))
    found = gc.force_closure(np.eye(3), normals, 0.3)
    assert not found.closed
    assert found.verify()
    assert found.margin == -1e6
    kept = from_record(gc.ClosureCertificate, json.loads(text_of(record_of(found))))
    assert kept.verify()
    assert kept.margin == found.margin


def test_a_balanced_pair_beside_idle_contacts_is_decided():
    """Two opposite contacts balance; the others turn the object about their line one way only."""
    positions = np.array([[-1.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0]])
    normals = np.array([[1.0, 0, 0], [-1, 0, 0], [0, -0.6, 0.8], [0, 0.6, -0.8]])
    certificate = gc.force_closure(positions, normals, 0.3)
    assert not certificate.closed
    assert certificate.margin == pytest.approx(0.0, abs=1e-9)
    assert certificate.verify()


def test_zero_friction_is_decided_for_any_number_of_contacts():
    """Without friction four contacts never close; seven or more may."""
    rng = np.random.default_rng(16)
    seen = {True: 0, False: 0}
    for _ in range(60):
        positions, normals = random_contacts(rng, int(rng.integers(2, 13)), spread=1.5)
        for friction in (np.zeros(len(normals)), rng.choice([0.0, 0.4], len(normals))):
            certificate = gc.force_closure(positions, normals, friction)
            assert certificate.verify()
            if not friction.any() and len(normals) < 7:
                assert not certificate.closed
            seen[certificate.closed] += 1
    assert min(seen.values()) >= 8


def test_the_boundary_itself_is_refuted():
    """Exactly critical: forces exist only on the cones, and a twist touches all of them."""
    positions, normals = images(MIRRORED, [1.0, 0.25, 0.5], INWARD)
    certificate = gc.force_closure(positions, normals, 0.25)
    assert not certificate.closed
    assert certificate.verify()
    assert gc.force_closure(positions, normals, 0.25 * (1.0 + 1e-6)).closed


def test_a_certificate_without_contacts_is_refused():
    found = gc.force_closure(TETRA_CENTERS, TETRA_NORMALS, 0.5)
    none = {name: np.zeros((0, 3)) for name in ("positions", "normals", "forces")}
    assert found.verify()
    assert forged(found, **none, friction=np.zeros(0)).verify() is False


def test_a_decision_that_its_forces_do_not_prove_is_no_certificate(monkeypatch):
    wrong = Decision(
        0.1, TETRA_NORMALS * np.array([[2.0], [1], [1], [1]]), np.zeros(6), closed=True
    )
    monkeypatch.setattr(module, "decide", lambda _: wrong)
    with pytest.raises(gc.UndecidedError, match=r"neither .* can be proved \(margin 0\.1\)"):
        gc.force_closure(TETRA_CENTERS, TETRA_NORMALS, 0.5)
