"""Covers of all twists: they leave nothing out, and nothing false passes their check."""

import dataclasses
from collections import deque
from fractions import Fraction

import numpy as np
import pytest

import grasp_core as gc
import scenes
from grasp_core.regions.certify_regions import certify_regions
from grasp_core.regions.regions_certificate import EDGES, UNDIVIDED, TwistCover
from tests.grasp_core.exact_judges import exactly

SMALL = 1_000


@pytest.fixture(scope="module")
def proved():
    body = scenes.example_object("wedge")
    (grasp,) = gc.plan(body, 0.5, families=("concurrent",), limit=1).grasps
    return certify_regions(body, grasp, 0.5, max_cones=SMALL)


def corners_of(proved):
    """Corners of the regions in the coordinates of the proof."""
    return [(region.polygon - proved.origin) / proved.scale for region in proved.regions]


def random_tree(rng, cuts):
    """A tree in levels, cut at random; every cone covered by the same forces."""
    codes, width = [], 64
    while width:
        cut = rng.random(width) < 0.5 if len(codes) < cuts else np.zeros(width, dtype=bool)
        codes += np.where(cut, rng.integers(len(EDGES), size=width), UNDIVIDED).tolist()
        width = 2 * int(cut.sum())
    leaves = codes.count(UNDIVIDED)
    axes = rng.normal(size=(6, 6))
    return TwistCover(axes, codes, np.tile([1.0, 0.0, 0.0], (leaves, 4, 1)))


def cones_of(cover):
    return np.concatenate([rays for _, rays in cover.leaves()])


@pytest.mark.parametrize("seed", range(1))
def test_every_twist_is_in_a_cone_and_inside_of_one_only(seed):
    """In coordinates of the axes: a twist is a sum of rays with weights that are not negative."""
    rng = np.random.default_rng(seed)
    cones = cones_of(random_tree(rng, 1000))
    assert len(cones) > 500
    inverses = np.linalg.inv(cones)
    inside = 0
    for twist in rng.normal(size=(300, 6)):
        weights = twist @ inverses
        assert (weights >= -1e-9).all(axis=1).any()
        inside += int((weights > 1e-9).all(axis=1).sum())
    assert 290 <= inside <= 300


def test_a_cover_holds_in_rational_arithmetic():
    """Every number as the fraction that it is: nothing is rounded, nothing allowed for."""
    body = scenes.example_object("wedge")
    (grasp,) = gc.plan(body, 0.5, families=("concurrent",), limit=1).grasps
    small = certify_regions(body, grasp, 0.5, max_cones=100)
    cover, mu = small.cover, exactly(small.friction)
    axes, normals = exactly(cover.axes), exactly(small.normals)
    origin, scale = exactly(small.origin), Fraction(small.scale)
    corners = [(exactly(region.polygon) - origin) / scale for region in small.regions]
    codes, forces, checked = iter(cover.codes), iter(exactly(cover.forces)), 0
    cones = deque(np.diag([1 - 2 * (s >> j & 1) for j in range(6)]).astype(object)
                  for s in range(64))  # fmt: skip
    while cones:
        cone, code = cones.popleft(), next(codes)
        if code < UNDIVIDED:
            for end in EDGES[code]:
                cones.append(cone.copy())
                cones[-1][end] = cone[EDGES[code][0]] + cone[EDGES[code][1]]
            continue
        F = next(forces)
        for f, n, friction in zip(F, normals, mu, strict=True):
            across = f - (f @ n) * n / (n @ n)
            assert f @ n >= 0
            assert (across @ across) * (n @ n) <= (friction * (f @ n)) ** 2
        for twist in cone @ axes:
            power = sum(f @ twist[:3] + min((x * np.cross(f, twist[3:])).sum() for x in places)
                        for f, places in zip(F, corners, strict=True))  # fmt: skip
            assert power > 0
            checked += 1
    assert next(codes, None) is next(forces, None) is None
    assert checked == 6 * len(cover.forces) > 300


def tampered(proved, **changed):
    cover = proved.cover
    given = {name: getattr(cover, name).copy() for name in ("axes", "codes", "forces")}
    for name, change in changed.items():
        change(given[name])
    return dataclasses.replace(proved, cover=TwistCover(**given))


def weaker(forces):
    forces[len(forces) // 2] *= -1.0


def nothing(forces):
    forces[len(forces) // 2] = 0.0


def outside(forces):
    finger = int(np.linalg.norm(forces[7], axis=1).argmax())
    forces[7, finger] = np.cross(forces[7, finger], [0.3, 0.2, 0.9])


def other(forces):
    forces[: len(forces) // 2] = np.roll(forces[: len(forces) // 2], 1, axis=0)


def singular(axes):
    axes[0] = axes[1]


@pytest.mark.parametrize(
    "changed",
    [{"forces": weaker}, {"forces": nothing}, {"forces": outside}, {"forces": other},
     {"axes": singular}],
    ids=["forces turned round", "no forces", "a force outside its cone", "forces of other cones",
         "dependent axes"],
)  # fmt: skip
def test_a_cover_that_was_tampered_with_is_refused(proved, changed):
    assert proved.verify()
    assert not tampered(proved, **changed).verify()


def test_what_a_proof_does_not_speak_of_is_refused(proved):
    corners = corners_of(proved)
    assert proved.cover.verify(corners, proved.normals, proved.friction)
    assert not proved.cover.verify(corners[:3], proved.normals[:3], proved.friction[:3])
    assert not proved.cover.verify(corners, proved.normals, proved.friction[:3])
    assert not proved.cover.verify(corners, 2.0 * proved.normals, proved.friction)
    assert not proved.cover.verify([np.full((3, 3), np.nan)] * 4, proved.normals, proved.friction)


@pytest.mark.parametrize("size", [1e-200, 1e-100, 1e40])
def test_the_size_of_forces_proves_nothing(proved, size):
    """Squares of tiny numbers are zero: a friction cone could not be told from a line."""
    corners = corners_of(proved)
    scaled = dataclasses.replace(proved.cover, forces=size * proved.cover.forces)
    assert scaled.verify(corners, proved.normals, proved.friction)
    assert not scaled.verify(corners, proved.normals, np.full(4, 0.01))


def test_pulling_contacts_are_not_taken_for_pushing_ones(proved):
    corners = corners_of(proved)
    assert not proved.cover.verify(corners, -proved.normals, -proved.friction)
    assert not proved.cover.verify(corners, -proved.normals, proved.friction)
    assert not proved.cover.verify([np.zeros((0, 3))] * 4, proved.normals, proved.friction)


def test_a_cover_with_a_hole_is_refused(proved):
    cover = proved.cover
    cut = dataclasses.replace(cover, forces=cover.forces[:-1], codes=cover.codes[:-1])
    assert not dataclasses.replace(proved, cover=cut).verify()
    more = dataclasses.replace(
        cover,
        codes=np.append(cover.codes, UNDIVIDED),
        forces=np.vstack([cover.forces, cover.forces[:1]]),
    )
    assert not dataclasses.replace(proved, cover=more).verify()


@pytest.mark.parametrize("finger", range(4))
def test_larger_regions_and_less_friction_are_not_proved(proved, finger):
    region = proved.regions[finger]
    middle = region.polygon.mean(axis=0)
    grown = dataclasses.replace(region, polygon=middle + 1.2 * (region.polygon - middle))
    regions = tuple(grown if i == finger else r for i, r in enumerate(proved.regions))
    assert not dataclasses.replace(proved, regions=regions).verify()
    assert not dataclasses.replace(proved, friction=0.9 * proved.friction).verify()
