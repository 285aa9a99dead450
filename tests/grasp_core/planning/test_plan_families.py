"""The families of one plan: what each finds, its counts, bounds and tilted cones."""

import math

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.families.constructions import CONSTRUCTIONS
from grasp_core.families.placements import LEAST_RADIUS
from grasp_core.objects.face_pieces import face_shapes
from grasp_core.objects.standard_order import standard
from grasp_core.planning.planned_cones import PlannedCones
from grasp_core.planning.quadruples import all_blocks
from scenes.example_objects import example_object

TEN_DEGREES = math.tan(math.radians(10.0))
DISCS = ("concurrent", "pencil")
"""The families with independent discs."""
FAMILIES = (*DISCS, "regulus")


def test_every_family_is_planned_and_every_witness_is_of_its_family():
    found = gc.plan(example_object("chamfered-box"), TEN_DEGREES, families=FAMILIES, cones="normal")
    assert list(found.counts.families) == list(FAMILIES)
    assert {grasp.family for grasp in found.grasps} == set(FAMILIES)
    for grasp in found.grasps:
        x, f = grasp.witness.points, grasp.witness.forces
        assert gc.classify_lines(x, grasp.witness.directions) == grasp.family
        np.testing.assert_array_equal(x, grasp.positions)
        np.testing.assert_allclose(f.sum(axis=0), 0.0, atol=1e-9)
        assert np.einsum("ki,ki->", f, grasp.normals) == pytest.approx(1.0)
        assert len(grasp.focus_points) == (1 if grasp.family == "concurrent" else 2)


@pytest.mark.parametrize("name", ["chamfered-box", "double-wedge-bar", "random-12-1"])
def test_counts_add_up_and_nothing_is_rejected(name):
    found = gc.plan(example_object(name), TEN_DEGREES, limit=30, families=FAMILIES, cones="normal")
    for family, counts in found.counts.families.items():
        ended = counts.infeasible + counts.found + counts.duplicates + counts.rejected
        assert counts.tried == ended
        assert counts.rejected == counts.undecided == 0
        orders = 1 if family == "concurrent" else 3
        assert counts.tried + counts.pruned == orders * found.counts.quadruples


def test_an_elongated_object_has_pencils_where_it_has_no_concurrent_grasp():
    found = gc.plan(
        example_object("double-wedge-bar"), TEN_DEGREES, families=FAMILIES, cones="normal"
    )
    families = [grasp.family for grasp in found.grasps]
    assert families.count("concurrent") == 0
    assert families.count("pencil") == 9
    assert found.grasps[0].radius == pytest.approx(0.113774 * 0.02, rel=1e-5)
    needing_friction = [g for g in found.grasps if g.critical_friction > 0.05]
    assert {grasp.family for grasp in needing_friction} == {"regulus"}


def test_pairings_that_lead_to_the_same_contacts_are_kept_once():
    counts = gc.plan(example_object("tetrahedron"), 0.3).counts.families["regulus"]
    assert (counts.tried, counts.duplicates, counts.found) == (3, 2, 1)


def test_a_limit_is_shared_between_the_families():
    found = gc.plan(example_object("icosahedron"), TEN_DEGREES, limit=9)
    assert [g.family for g in found.grasps].count("regulus") == 3
    assert [g.family for g in found.grasps].count("pencil") == 3
    radii = np.array([g.radius for g in found.grasps])
    assert (np.diff(radii) < 1e-12).all()


def test_radii_stay_below_the_bounds_that_prune():
    given, theta = example_object("random-12-1"), math.radians(8.0)
    planned = standard(given)
    body = planned.body
    cones = PlannedCones(body, face_shapes(body), theta, tilted=True)
    ((room,), make), tested = all_blocks(cones, len(body.faces), np.empty((0, 4), dtype=int)), 0
    for family in DISCS:
        wide, loose = make(0).ranked(CONSTRUCTIONS[family], LEAST_RADIUS)
        coned, tight = wide.coned(slice(None)).ranked(CONSTRUCTIONS[family])
        coarse = dict(zip(map(tuple, wide.faces.tolist()), loose, strict=True))
        limits = [coarse[tuple(each)] for each in coned.faces.tolist()]
        best = tight.max(axis=(1, 2))
        assert (best <= limits).all()
        bounds = {
            tuple(sorted(planned.faces[face] for face in faces)): bound
            for faces, bound in zip(coned.faces.tolist(), best, strict=True)
        }
        assert max(bounds.values()) <= room
        for grasp in gc.plan(given, 1.0, theta_deg=8.0, families=family, cones="tilted").grasps:
            assert grasp.radius <= bounds[tuple(sorted(grasp.faces))] * body.radius * (1 + 1e-6)
            tested += 1
    assert tested >= 80


def test_tilted_cones_never_make_discs_smaller():
    tested = larger = 0
    for name in ("wedge", "random-10-1"):
        body = example_object(name)
        paper, ours = (
            {g.id: g.radius for g in gc.plan(body, 0.3, families="concurrent", cones=cones).grasps}
            for cones in ("normal", "tilted")
        )
        assert set(paper) <= set(ours)
        for name_, radius in paper.items():
            assert ours[name_] >= 0.8 * radius
            larger += ours[name_] > 1.01 * radius
            tested += 1
    assert tested >= 30
    assert larger > 0.5 * tested


def test_a_focus_before_some_fingers_and_behind_others_gives_regions_where_nothing_else_does():
    body, mixed = example_object("l-bracket"), 0
    for grasp in gc.plan(body, 0.5).grasps:
        if grasp.family != "concurrent":
            continue
        heights = np.einsum(
            "ki,ki->k", grasp.focus_points[0] - grasp.positions,
            np.array([cone.axis for cone in grasp.force_cones]),
        )  # fmt: skip
        if heights.min() < 0.0 < heights.max():
            rng = np.random.default_rng(0)
            for _ in range(20):
                points = [
                    rng.dirichlet(np.full(len(region.polygon), 0.3)) @ region.polygon
                    for region in grasp.regions
                ]
                assert gc.force_closure(np.array(points), grasp.normals, 0.5).closed
            mixed += 1
    assert mixed >= 4
