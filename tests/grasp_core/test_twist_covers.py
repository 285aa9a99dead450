"""Covers of all twists: they leave nothing out, and nothing false passes their check."""

import dataclasses

import numpy as np
import pytest

import grasp_core as gc
import scenes
from grasp_core.certified_regions import certify_regions
from grasp_core.twist_covers import EDGES, LEAF, TwistCover, orthants

SMALL = 20_000


@pytest.fixture(scope="module")
def proved():
    body = scenes.example_object("wedge")
    (grasp,) = gc.plan(body, 0.5, families=("concurrent",), limit=1).grasps
    return certify_regions(body, grasp, 0.5, cones=SMALL)


def random_tree(rng, cuts):
    """A tree in levels, cut at random; every cone covered by the same force."""
    codes, width = [], 64
    while width:
        cut = rng.random(width) < 0.5 if len(codes) < cuts else np.zeros(width, dtype=bool)
        codes += np.where(cut, rng.integers(len(EDGES), size=width), LEAF).tolist()
        width = 2 * int(cut.sum())
    leaves = codes.count(LEAF)
    axes = rng.normal(size=(6, 6))
    return TwistCover(axes, codes, np.zeros(leaves), np.tile([1.0, 0.0, 0.0], (leaves, 1)))


def cones_of(cover):
    return np.concatenate([rays for _, rays in cover.leaves()])


def test_theorthants_are_all_there():
    assert len({tuple(cone.sum(axis=0)) for cone in orthants()}) == 64
    assert (np.abs(np.linalg.det(orthants())) == 1.0).all()


@pytest.mark.parametrize("seed", range(3))
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


def test_cones_are_cut_exactly():
    cones = cones_of(random_tree(np.random.default_rng(5), 4000))
    assert (cones == np.round(cones)).all()
    assert np.abs(cones).max() >= 4.0
    np.testing.assert_allclose(np.abs(np.linalg.det(cones)), 1.0, rtol=1e-6)


def test_where_a_cover_says_so_the_force_has_power(proved):
    """On twists between the rays, for points between the corners, by the definition."""
    rng = np.random.default_rng(1)
    regions = [(r.polygon - proved.center) / proved.scale for r in proved.regions]
    tried = 0
    for where, rays in proved.cover.leaves():
        for place in rng.integers(len(rays), size=min(len(rays), 40)):
            contact = int(proved.cover.contacts[where][place])
            force = proved.cover.forces[where][place]
            twist = rng.dirichlet(np.ones(6)) @ rays[place] @ proved.cover.axes
            weights = rng.dirichlet(np.full(len(regions[contact]), 0.2))
            point = weights @ regions[contact]
            assert force @ (twist[:3] + np.cross(twist[3:], point)) > 0.0
            tried += 1
    assert tried > 300


def tampered(proved, **changed):
    cover = proved.cover
    given = {name: getattr(cover, name).copy() for name in ("axes", "codes", "contacts", "forces")}
    for name, change in changed.items():
        change(given[name])
    return dataclasses.replace(proved, cover=TwistCover(**given))


def weaker(forces):
    forces[len(forces) // 2] *= -1.0


def outside(forces):
    forces[7] = np.cross(forces[7], [0.3, 0.2, 0.9])


def other(contacts):
    contacts[: len(contacts) // 2] = (contacts[: len(contacts) // 2] + 1) % 4


def singular(axes):
    axes[0] = axes[1]


@pytest.mark.parametrize(
    "changed",
    [{"forces": weaker}, {"forces": outside}, {"contacts": other}, {"axes": singular}],
    ids=["a force turned round", "a force outside its cone", "other contacts", "dependent axes"],
)
def test_a_cover_that_was_tampered_with_is_refused(proved, changed):
    assert proved.verify()
    assert not tampered(proved, **changed).verify()


def test_what_a_proof_does_not_speak_of_is_refused(proved):
    corners = [(region.polygon - proved.center) / proved.scale for region in proved.regions]
    friction = np.full(4, proved.friction)
    assert proved.cover.verify(corners, proved.normals, friction)
    assert not proved.cover.verify(corners[:3], proved.normals[:3], friction[:3])
    assert not proved.cover.verify(corners, proved.normals, friction[:3])
    assert not proved.cover.verify(corners, 2.0 * proved.normals, friction)
    assert not proved.cover.verify([np.full((3, 3), np.nan)] * 4, proved.normals, friction)


def test_a_cover_with_a_hole_is_refused(proved):
    cover = proved.cover
    cut = dataclasses.replace(cover, contacts=cover.contacts[:-1], forces=cover.forces[:-1],
                              codes=cover.codes[:-1])  # fmt: skip
    assert not dataclasses.replace(proved, cover=cut).verify()
    more = dataclasses.replace(
        cover, codes=np.append(cover.codes, LEAF), contacts=np.append(cover.contacts, 0),
        forces=np.vstack([cover.forces, cover.forces[:1]]),
    )  # fmt: skip
    assert not dataclasses.replace(proved, cover=more).verify()


@pytest.mark.parametrize("finger", range(4))
def test_larger_regions_and_less_friction_are_not_proved(proved, finger):
    region = proved.regions[finger]
    middle = region.polygon.mean(axis=0)
    grown = dataclasses.replace(region, polygon=middle + 1.2 * (region.polygon - middle))
    regions = tuple(grown if i == finger else r for i, r in enumerate(proved.regions))
    assert not dataclasses.replace(proved, regions=regions).verify()
    assert not dataclasses.replace(proved, friction=0.9 * proved.friction).verify()


def test_shapes_are_checked():
    with pytest.raises(gc.InputError, match="forces"):
        TwistCover(np.eye(6), [LEAF] * 64, [0] * 64, np.zeros((63, 3)))
    with pytest.raises(gc.InputError, match="known codes"):
        TwistCover(np.eye(6), [LEAF + 1] * 64, [], np.zeros((0, 3)))
