"""Searches of regions and contacts do not depend on last digits where much is equal.

Places are shaken by what another processor makes of them. Regular objects have equal candidates
everywhere, so that a search that sees last digits takes another way each time.
"""

from dataclasses import replace
from functools import cache
from itertools import combinations

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.objects.face_pieces import inset_piece
from grasp_core.optimizing import better_contacts as best_contacts
from grasp_core.optimizing.ascent import ContactFaces
from grasp_core.optimizing.better_contacts import pieces_under
from grasp_core.planning.given_contacts import seat
from grasp_core.quality.wrench_limits import WrenchBody, weakest_from
from scenes.example_objects import example_object

SHAKEN = 1e-14
"""In object radii: what another processor makes of a place, generously."""
SAME = 1e-9
TRIALS = 2
CONES = 600


@cache
def planned(name, family):
    body = example_object(name)
    return body, gc.plan(body, 0.5, families=(family,), limit=1).grasps[0]


def shaken(rng, values, size=1.0):
    return values + SHAKEN * size * rng.uniform(-1.0, 1.0, np.shape(values))


def moved(rng, body, grasp):
    """A grasp whose contacts are shaken in their planes."""
    contacts = []
    for contact in grasp.contacts:
        shift = shaken(rng, np.zeros(3), body.radius)
        shift -= (shift @ contact.normal) * contact.normal
        contacts.append(replace(contact, position=contact.position + shift))
    return replace(grasp, contacts=tuple(contacts))


@pytest.mark.parametrize(
    ("name", "family", "more"),
    [
        ("octahedron", "concurrent", {}),
        pytest.param("wedge", "pencil", {}, marks=pytest.mark.slow),
        pytest.param("octahedron", "concurrent", {"recenter": True}, marks=pytest.mark.slow),
    ],
)
def test_regions_do_not_depend_on_last_digits(name, family, more):
    body, grasp = planned(name, family)
    rng = np.random.default_rng(0)
    own = gc.certify_regions(body, grasp, 0.5, max_cones=CONES, **more)
    for _ in range(TRIALS if not more else 1):
        found = gc.certify_regions(body, moved(rng, body, grasp), 0.5, max_cones=CONES, **more)
        assert found.verify()
        np.testing.assert_array_equal(found.cover.codes, own.cover.codes)
        assert found.radius == pytest.approx(own.radius, rel=SAME)
        for one, two in zip(found.regions, own.regions, strict=True):
            np.testing.assert_allclose(one.polygon, two.polygon, atol=SAME * body.radius)


@pytest.mark.parametrize("name", ["octahedron", pytest.param("box", marks=pytest.mark.slow)])
def test_a_climb_does_not_depend_on_last_digits(name):
    """From contacts of the grasp, which is symmetric on these objects."""
    body, grasp = planned(name, "concurrent")
    rooms = tuple(inset_piece(piece, 0.05) for piece in pieces_under(body, grasp))
    points = (grasp.positions - body.center_of_mass) / body.radius
    y = np.array([p.frame.T @ (at - p.origin) for p, at in zip(rooms, points, strict=True)])
    faces = ContactFaces(rooms, 0.5)
    rng = np.random.default_rng(2)
    starts = [0.9 * y, 0.5 * y]
    for start in starts:
        end, quality = faces.climb(start)
        assert np.abs(end - start).max() > 1e-3
        for _ in range(2):
            again, found = faces.climb(shaken(rng, start))
            np.testing.assert_allclose(again, end, atol=SAME)
            assert found.lower == pytest.approx(quality.lower, rel=SAME)


def test_contacts_are_moved_only_where_they_are_proved_to_be_better(monkeypatch):
    """Bounds of equally good contacts overlap, and which lower one is larger is chance."""
    body, grasp = planned("wedge", "concurrent")
    exact, asked = best_contacts.ferrari_canny, []
    own = gc.optimize_contacts(body, grasp, 0.5)
    assert own.after.lower > own.before.upper
    assert own.grasp is not grasp

    def doubtful(*given, **more):
        asked.append(exact(*given, **more))
        return replace(asked[-1], upper=2.0) if len(asked) == 1 else asked[-1]

    monkeypatch.setattr(best_contacts, "ferrari_canny", doubtful)
    assert gc.optimize_contacts(body, grasp, 0.5).grasp is grasp
    assert len(asked) > 1


def test_a_given_contact_on_an_edge_is_on_the_first_face():
    """With a normal between those of both faces, which lean less than is allowed."""
    body, rng, tested = example_object("random-40-7"), np.random.default_rng(4), 0
    for i, j in combinations(range(len(body.faces)), 2):
        one, two = body.faces[i], body.faces[j]
        apart = np.linalg.norm(one.polygon[:, None] - two.polygon[None], axis=2).min(axis=1)
        ends = one.polygon[apart < SAME * body.radius]
        between = (one.normal + two.normal) / np.linalg.norm(one.normal + two.normal)
        if len(ends) < 2 or between @ one.normal < np.cos(np.radians(19.0)):
            continue
        for _ in range(TRIALS):
            points = shaken(rng, np.array([ends.mean(axis=0)] * 4), body.radius)
            assert set(seat(body, points, [between] * 4).faces) == {i}
        tested += 1
    assert tested >= 5


def test_the_weakest_wrench_is_the_same_one_of_equally_weak_ones():
    body, grasp = planned("octahedron", "pencil")
    arms, rng, found = grasp.positions - body.center_of_mass, np.random.default_rng(6), []
    for _ in range(TRIALS):
        shaken_arms = arms * (1.0 + 1e-14 * rng.normal(size=arms.shape))
        resisted = WrenchBody(shaken_arms, grasp.normals, np.full(4, 0.5), 20.0)
        found.append(weakest_from(resisted, (), body.radius).wrench)
    assert np.ptp(found, axis=0).max() <= 1e-9
