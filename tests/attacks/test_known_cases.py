"""False certificates that once verified, one of each kind."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import grasp_core as gc
import scenes
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.objects.face_pieces import unit_pieces
from grasp_core.quality.ferrari_canny import COUNTING_RAYS, FerrariCanny, InnerPolytope
from grasp_core.quality.wrench_limits import WrenchLimit
from tests.attacks import contacts, faces, limits, wrench_sets
from tests.attacks.searching import attacked
from tests.grasp_core.exact_judges import closed_exactly
from tests.judges import TETRA_CENTERS, TETRA_NORMALS


def test_a_sliver_in_two_orders_of_its_corners_encloses_nothing():
    """A ray through its side is met once by rounding, and twice or never in truth."""
    u = COUNTING_RAYS[0] / np.linalg.norm(COUNTING_RAYS[0])
    corners = np.array([np.arange(6), [3, 1, 4, 0, 5, 2], [5, 4, 3, 2, 1, 0], [1, 0, 2, 4, 3, 5]])
    for seed in range(200):
        d = np.random.default_rng(seed).normal(size=(6, 6))
        d[5] = -d[1:5].sum(axis=0)
        for other in corners[1:]:
            twice = InnerPolytope(u + 1e-9 * d, np.array([corners[0], other]), np.array([u, u]))
            assert twice.proved_radius(SimpleNamespace(G=np.eye(6))) == -np.inf


def test_a_border_around_zero_is_proved_in_any_order_of_its_corners():
    """The simplex with corners along the axes and opposite to them, seen along the first ray."""
    points = np.vstack([np.eye(6), -np.ones(6)])
    rng = np.random.default_rng(0)
    corners = np.array([rng.permutation(np.delete(np.arange(7), j)) for j in range(7)])
    normals = np.linalg.solve(points[corners], np.ones((7, 6, 1)))[:, :, 0]
    distance = 1.0 / np.linalg.norm(normals, axis=1)
    normals *= distance[:, None]
    for times, radius in ((1, distance.min()), (2, -np.inf), (3, distance.min())):
        found = InnerPolytope(points, np.tile(corners, (times, 1)), np.tile(normals, (times, 1)))
        proved = found.proved_radius(SimpleNamespace(G=np.eye(6)))
        assert proved == pytest.approx(radius, rel=1e-12)


@pytest.mark.parametrize("length", [0.0, 1e13, 1e30])
def test_no_long_facet_proves_that_nothing_is_resisted(length):
    """Two opposite contacts hold 10 N at friction 0.5, and no turn about their line."""
    x, n = np.array([[-0.05, 0, 0], [0.05, 0, 0]]), np.array([[1.0, 0, 0], [-1, 0, 0]])
    w, y = np.array([0.0, 0, 1, 0, 0, 0]), np.array([0.0, 0, -1, length, 0, 0])
    (true,) = gc.wrench_limits(x, n, 0.5, [w], max_normal_force=10.0)
    assert true.limit == pytest.approx(10.0)
    assert true.verify(x, n, 0.5, max_normal_force=10.0)
    false = WrenchLimit(w, 0.0, 0.0, np.zeros((2, 3)), y)
    assert not false.verify(x, n, 0.5, max_normal_force=10.0)
    # a facet that is longer than it need be, but not too long, proves what is true
    held = replace(true, facet=np.array([0.0, 0, -1, min(length, 1e5), 0, 0]))
    assert held.verify(x, n, 0.5, max_normal_force=10.0)


def test_one_joint_gives_another_no_slack():
    """One that feels pushes 1e9 times as much as it can hold lets no other exceed its torque."""
    x, n = np.array([[-0.05, 0, 0], [0.05, 0, 0]]), np.array([[1.0, 0, 0], [-1, 0, 0]])
    levers = np.zeros((2, 6))
    levers[0, 0], levers[1, 1] = 1.0, 1e9  # the second feels a tangential force that nothing needs
    motors = gc.Motors(levers, np.array([1.0, 1.0]), np.zeros(2))
    w = np.array([0.0, 0, 1, 0, 0, 0])
    (true,) = gc.wrench_limits(x, n, 0.5, [w], max_normal_force=10.0, motors=motors)
    assert true.limit == pytest.approx(1.0, rel=1e-5)
    pushes = np.array([[10.0, 0, -5.0], [-10.0, 0, -5.0]])
    false = replace(true, limit=10.0, upper=10.0, forces=pushes)
    assert not false.verify(x, n, 0.5, max_normal_force=10.0, motors=motors)


def test_a_far_contact_gives_no_slack():
    """With levers of 1e12, 1e-12 of the longest wrench is a newton."""
    w = WrenchSet.at(TETRA_CENTERS, TETRA_NORMALS, np.full(4, 0.5))
    far = WrenchSet.at(np.array([[1e12, 0, 0]]), np.array([[1.0, 0, 0]]), np.array([0.5]))
    more = WrenchSet(np.hstack([w.G, far.G]), np.full(5, 0.5), "l1")
    forces = np.tile([0.2, 0, 0], 5)
    false = FerrariCanny(-3.0, 0.0, more, np.eye(6)[0], None, forces)
    assert more.support(false.direction)[0] > 0.5
    assert not false.verify()


def test_contacts_near_a_line_need_some_friction_only():
    """Two of them are all but one: of a turn about them next to nothing is left at rest."""
    found = contacts.near_a_line(0)
    assert closed_exactly(found.forces, found.positions, found.normals, found.upper)
    for t in np.geomspace(1e-9, 1e-6, 60):
        twist = np.array([0.0, 0, 0, t, 1.0, 0.0])
        false = replace(found, lower=math.inf, upper=math.inf, twist=twist, forces=None)
        assert not false.verify()


def test_no_short_twist_opens_closed_contacts():
    """Squares of 1e-162 vanish, and what slides along a contact with them."""
    found = contacts.needed(0)
    mu = np.full(len(found.normals), found.upper * (1.0 + 1e-6))
    y = contacts.about_origin(found.twist, found.positions[0])
    for size in range(-323, -100):
        short = y / np.abs(y).max() * 10.0**size
        false = gc.ClosureCertificate(False, 0.0, found.positions, found.normals, mu, None, short)
        assert not false.verify()


@pytest.mark.parametrize(
    ("attack", "tries"),
    [
        (contacts.CLOSURE, 200),
        (contacts.SOFT, 100),
        pytest.param(limits.HAND, 150, marks=pytest.mark.slow),
        pytest.param(wrench_sets.QUALITY, 200, marks=pytest.mark.slow),
    ],
)
def test_nothing_short_and_no_sliver_proves_anything(attack, tries):
    """Twists, facets and multipliers down to the smallest number there is; thin simplices."""
    found = attacked(attack, tries)
    assert found.raised == []
    assert found.accepted == []


def test_what_a_grip_has_kept_does_not_count():
    c, best = limits.squeeze(0)
    grip = replace(c.grip)
    grip.__dict__["response"] = 0.5 * c.grip.response
    false = replace(c, grip=grip, scale=2.0 * c.scale, upper=2.0 * c.upper * (1.0 + 1e-8))
    assert false.scale > 1.9 * best
    assert not false.verify()


def test_a_long_unit_of_length_gives_regions_no_slack():
    """Borders that a region leaves by a tenth of its width."""
    r = faces.smaller(faces.genuine(0)[0], np.random.default_rng(0))
    assert r.verify()
    middle = r.regions[0].polygon.mean(axis=0)
    tight = middle + 0.999 * (r.regions[0].polygon - middle)
    for s in np.geomspace(1.0, 1e8, 60):
        axes = r.cover.axes * np.repeat([1.0, s], 3)
        cover = replace(r.cover, axes=axes / np.linalg.norm(axes, axis=1).max())
        false = replace(r, borders=(tight, *r.borders[1:]), scale=r.scale * s, cover=cover)
        assert not false.verify()


def test_a_polygon_that_goes_around_many_times_holds_no_larger_disc():
    """Discs through the farthest corners, of which the polygons lack more than a hundredth."""
    r = faces.smaller(faces.genuine(1)[0], np.random.default_rng(0))
    arms = [p.polygon - c for p, c in zip(r.regions, r.centers, strict=True)]
    wide = replace(r, radius=max(float(np.linalg.norm(each, axis=1).max()) for each in arms))
    for copies in (1, 20, 150):
        parts = tuple(replace(p, polygon=np.tile(p.polygon, (copies, 1))) for p in r.regions)
        assert replace(r, regions=parts).verify() == (copies == 1)
        assert not replace(wide, regions=parts).verify()


def test_fields_of_a_piece_agree_to_its_own_size():
    """A piece of an object of size 1e-6, whose rows reach a thousandth of it too far."""
    piece = unit_pieces(scenes.example_object("box"))[0]
    s = 1e-6
    small = replace(
        piece, origin=s * piece.origin, corners=s * piece.corners, b=s * piece.b,
        inradius=s * piece.inradius,
    )  # fmt: skip
    assert piece.is_sound()
    assert small.is_sound()
    assert not replace(small, b=small.b + 9e-10).is_sound()
