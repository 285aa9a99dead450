"""What becomes of every four faces: held, proved to hold nothing, undecided; and how it is said."""

import math
from itertools import pairwise

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.planning.request import METHODS
from scenes.example_objects import example_object
from tests.marks import MORE
from tests.marks import more as more_of

TEN_DEGREES = math.tan(math.radians(10.0))
FAMILIES = ("concurrent", "pencil", "regulus")


@pytest.mark.parametrize(("name", "absent"), [("box", 0), ("prism", 0), ("random-10-1", 55)])
def test_the_free_method_decides_every_four_faces(name, absent):
    """With a grasp in force closure, or a proof of absence that checks."""
    body = example_object(name)
    found = gc.plan(body, 0.3, families=("free",))
    counts = found.counts.families["free"]
    assert counts.tried == found.counts.quadruples == counts.found + counts.infeasible
    assert counts.infeasible == len(found.absences) >= absent
    assert all(proof.verify() for proofs in found.absences.values() for proof in proofs)
    for grasp in found.grasps:
        assert gc.force_closure(grasp, friction=0.3).verify()
        assert grasp.critical_friction < 0.3
    assert found.grasps


def test_a_smaller_theta_binds_the_free_method_too():
    found = gc.plan(example_object("wedge"), 0.5, theta_deg=8.0, families="free")
    assert found.grasps
    for grasp in found.grasps:
        f, n = grasp.witness.forces, grasp.normals
        angles = np.arctan2(np.linalg.norm(np.cross(f, n), axis=1), np.einsum("ki,ki->k", f, n))
        assert np.degrees(angles).max() <= 8.0 + 1e-6
        assert grasp.critical_friction < math.tan(math.radians(8.0))


def test_every_face_quadruple_is_held_absent_or_named_undecided():
    found = gc.plan(example_object("l-bracket"), 0.001, families="free")
    held = {tuple(sorted(grasp.faces)) for grasp in found.grasps}
    assert len(held) + len(found.absences) + len(found.undecided) == found.counts.quadruples == 70
    assert not held & set(found.absences)
    assert found.counts.families["free"].undecided == len(found.undecided)


@pytest.mark.parametrize("name", ["box", "wedge", *more_of("prism", "l-bracket")])
def test_every_four_faces_are_held_or_proved_to_hold_nothing(name):
    """Also where no normals span: with tilted cones most grasps have regions."""
    for friction in (0.3, 0.8):
        found = gc.plan(example_object(name), friction, families=METHODS, cones="tilted")
        known, held = found.outcomes, {tuple(sorted(g.faces)) for g in found.grasps}
        assert (known.held, known.absent, known.open) == (len(held), len(found.absences), 0)
        assert known.held + known.absent == found.counts.quadruples
        regions = {tuple(sorted(g.faces)) for g in found.grasps if g.radius > 0.0}
        assert len(regions) >= 0.7 * len(held)
        for counts in found.counts.families.values():
            assert counts.rejected == 0


@pytest.mark.parametrize(
    ("name", "least"),
    [
        ("box", 25),
        pytest.param("wedge", 70, marks=MORE),
        pytest.param("octahedron", 100, marks=MORE),
    ],
)
def test_what_less_friction_holds_more_friction_holds(name, least):
    tested = 0
    plans = [
        gc.plan(example_object(name), friction, families=METHODS, cones="tilted")
        for friction in (0.1, 0.3, 0.7)
    ]
    for less, more in pairwise(plans):
        held = [{tuple(sorted(g.faces)) for g in plan.grasps} for plan in (less, more)]
        assert held[0] <= held[1]
        tested += len(held[0])
    assert tested >= least


def test_what_is_left_open_is_decided_when_asked_and_the_gap_is_said_before():
    """Long faces on which whole patches balance though no contacts do, or only few."""
    body = example_object("double-wedge-bar")
    quick, complete = (gc.plan(body, 0.3, complete=whole) for whole in (False, True))
    assert quick.outcomes.open == len(quick.undecided) == 8
    assert all(0.0 < share <= 1.0 for share in quick.undecided.values())
    assert complete.outcomes.open == len(complete.undecided) == 0
    assert complete.counts.families["free"].undecided == 0
    settled = set(complete.absences) - set(quick.absences)
    settled |= {tuple(sorted(g.faces)) for g in complete.grasps} - {
        tuple(sorted(g.faces)) for g in quick.grasps
    }
    assert settled == set(quick.undecided)
    assert all(proof.verify() for faces in settled for proof in complete.absences.get(faces, ()))


@pytest.mark.parametrize("name", ["box", "prism", "l-bracket", "cross", "hex-nut"])
def test_objects_without_spanning_quadruples_say_why(name):
    found = gc.plan(example_object(name), 0.5, families=FAMILIES, cones="normal")
    assert not found.grasps
    assert found.counts.spanning == 0
    assert "positively spanning" in found.absence
