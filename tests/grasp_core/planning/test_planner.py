import math
from typing import get_args

import numpy as np
import pytest
import trimesh

import grasp_core as gc
from grasp_core.families.placements import LEAST_RADIUS
from grasp_core.families.placing import CONSTRUCTIONS
from grasp_core.names import METHODS, RankBy
from grasp_core.objects.face_pieces import face_shapes
from grasp_core.objects.standard_order import standard
from grasp_core.planning.plan_search import PlanSearch, chosen
from grasp_core.planning.planner import put_together, search_grasps
from grasp_core.planning.quadruples import PlannedCones, all_blocks
from grasp_core.planning.result import PlanRequest
from grasp_core.stopping import Stop
from scenes.example_objects import example_object
from tests.benchmarks import invariance
from tests.benchmarks.objects import sphere_hull
from tests.grasp_core.bodies import from_edges

TEN_DEGREES = math.tan(math.radians(10.0))
RADIUS_ACCURACY = 1e-6
"""Radii are optima good to 1e-8 in object radii; two may differ by twice that."""
DISCS = ("concurrent", "pencil")
"""The families with independent discs."""
FAMILIES = (*DISCS, "regulus")


@pytest.mark.parametrize(
    ("name", "count"),
    [("tetrahedron", 1), ("octahedron", 2), ("dodecahedron", 30)],
)
def test_platonic_solids_have_the_known_number_of_quadruples_at_ten_degrees(name, count):
    """Quadruples with theta* above ten degrees; all of them carry a concurrent grasp."""
    found = gc.plan(
        example_object(name),
        TEN_DEGREES,
        families=("concurrent",),
        settings=gc.PlanSettings(cones="normal"),
    )
    wide = [grasp for grasp in found.grasps if grasp.span_angle > math.radians(10.0)]
    assert len(wide) == count
    assert found.counts.families["concurrent"].rejected == 0


TILTED = [(name, "tilted") for name in ("wedge", "random-10-1", "chamfered-box", "random-12-1")]
NORMAL = [(name, "normal") for name in ("icosahedron", "random-20-7", "random-30-2", "screwdriver")]


def test_every_grasp_lies_on_its_faces_inside_its_regions_whose_corners_are_closed():
    rng, tested = np.random.default_rng(7), 0
    for name, cones in TILTED + NORMAL:
        body = example_object(name)
        for grasp in gc.plan(
            body, 0.4, limit=20, families=DISCS, settings=gc.PlanSettings(cones=cones)
        ).grasps:
            for face, contact, region in zip(
                grasp.faces, grasp.contacts, grasp.regions, strict=True
            ):
                plane = body.faces[face]
                off = (region.polygon - plane.centroid) @ plane.normal
                np.testing.assert_allclose(off, 0.0, atol=1e-9)
                assert region.inscribed_radius >= grasp.radius * (1 - RADIUS_ACCURACY)
                assert contact.normal @ plane.normal == pytest.approx(1.0)
                inner = from_edges(region.polygon, plane.normal, contact.position)
                assert inner.min() >= -1e-12
            borders = [region.polygon for region in grasp.regions]
            for _ in range(4):
                points = [corners[rng.integers(len(corners))] for corners in borders]
                assert gc.force_closure(points, grasp.normals, 0.4).closed
            tested += 1
    assert tested >= 90


@pytest.mark.slow
@pytest.mark.parametrize("number", [4, 18, 25])
def test_faces_and_families_stay_where_vertices_move_by_a_thousand_millionth(number):
    name, friction = invariance.chosen(number)
    *_, count, differing = invariance.examine(
        (number, invariance.found_on(example_object(name), friction))
    )
    assert count > 50
    assert differing == []


def test_progress_is_reported_as_quadruples_are_tried():
    seen = []
    gc.plan(example_object("wedge"), progress=lambda *numbers: seen.append(numbers))
    done = [each for each, _, _ in seen]
    assert done == sorted(done)
    assert seen[-1][0] == seen[-1][1] == len(METHODS) * 70
    assert len(seen) >= 13


def test_an_object_with_too_many_faces_is_refused_at_once():
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.05)
    with pytest.raises(gc.InputError, match="over the limit of 1000"):
        gc.plan(gc.Polyhedron.from_mesh(ball.vertices, ball.faces, faces="planar"), limit=4)


def test_more_than_200_faces_need_simpler_plans():
    body = sphere_hull(240)
    for options in ({}, {"limit": 4}, {"families": FAMILIES}):
        with pytest.raises(gc.InputError, match="with more than 200 need simpler plans"):
            gc.plan(body, 0.2, **options)


def test_grasps_are_streamed_as_they_are_found():
    body = example_object("box")
    streamed = gc.iter_grasps(body, 0.4)
    first = next(streamed)
    everything = {first.id} | {grasp.id for grasp in streamed}
    assert everything == {grasp.id for grasp in gc.plan(body, 0.4).grasps}


def test_a_smaller_theta_binds_the_free_method_too():
    found = gc.plan(
        example_object("wedge"), 0.5, families="free", settings=gc.PlanSettings(theta_deg=8.0)
    )
    assert found.grasps
    for grasp in found.grasps:
        f, n = grasp.witness.forces, grasp.normals
        angles = np.arctan2(np.linalg.norm(np.cross(f, n), axis=1), np.einsum("ki,ki->k", f, n))
        assert np.degrees(angles).max() <= 8.0 + 1e-6
        assert grasp.critical_friction < math.tan(math.radians(8.0))


@pytest.mark.parametrize(("name", "absent"), [("box", 0), ("random-8-1", 1)])
def test_every_four_faces_are_held_or_proved_to_hold_nothing(name, absent):
    """Also where no normals span: with tilted cones most grasps have regions."""
    for friction in (0.3, 0.8):
        found = gc.plan(example_object(name), friction, families=METHODS)
        proofs = [proof for each in found.absences.values() for proof in each]
        assert all(proof.verify() for proof in proofs)
        assert len(proofs) >= absent * (friction < 0.5)
        assert all(gc.force_closure(grasp, friction=friction).verify() for grasp in found)
        known, held = found.outcomes, {tuple(sorted(g.faces)) for g in found.grasps}
        assert (known.held, known.absent, known.open) == (len(held), len(found.absences), 0)
        assert known.held + known.absent == found.counts.quadruples
        regions = {tuple(sorted(g.faces)) for g in found.grasps if g.radius > 0.0}
        assert len(regions) >= 0.7 * len(held)
        for counts in found.counts.families.values():
            assert counts.rejected == 0


def test_what_is_left_open_is_decided_when_asked_and_the_gap_is_said_before():
    """Long faces on which whole patches balance though no contacts do, or only few."""
    body = example_object("double-wedge-bar")
    quick, complete = (
        gc.plan(body, 0.3, settings=gc.PlanSettings(complete=whole)) for whole in (False, True)
    )
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


def test_every_family_is_planned_and_every_witness_is_of_its_family():
    found = gc.plan(
        example_object("chamfered-box"),
        TEN_DEGREES,
        families=FAMILIES,
        settings=gc.PlanSettings(cones="normal"),
    )
    assert list(found.counts.families) == list(FAMILIES)
    assert {grasp.family for grasp in found.grasps} == set(FAMILIES)
    for grasp in found.grasps:
        x, f = grasp.witness.points, grasp.witness.forces
        assert gc.classify_lines(x, grasp.witness.directions) == grasp.family
        np.testing.assert_array_equal(x, grasp.positions)
        np.testing.assert_allclose(f.sum(axis=0), 0.0, atol=1e-9)
        assert np.einsum("ki,ki->", f, grasp.normals) == pytest.approx(1.0)
        assert len(grasp.focus_points) == (1 if grasp.family == "concurrent" else 2)


@pytest.mark.parametrize("name", ["chamfered-box", "random-12-1"])
def test_counts_add_up_and_nothing_is_rejected(name):
    found = gc.plan(
        example_object(name),
        TEN_DEGREES,
        limit=30,
        families=FAMILIES,
        settings=gc.PlanSettings(cones="normal"),
    )
    for family, counts in found.counts.families.items():
        ended = counts.infeasible + counts.found + counts.duplicates + counts.rejected
        assert counts.tried == ended
        assert counts.rejected == counts.undecided == 0
        orders = 1 if family == "concurrent" else 3
        assert counts.tried + counts.pruned == orders * found.counts.quadruples


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
    blocks, tested = all_blocks(cones, len(body.faces), np.empty((0, 4), dtype=int)), 0
    (room,) = blocks.rooms
    for family in DISCS:
        wide, loose = blocks.make(0).ranked(CONSTRUCTIONS[family], LEAST_RADIUS)
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
        for grasp in gc.plan(
            given, 1.0, families=family, settings=gc.PlanSettings(theta_deg=8.0)
        ).grasps:
            assert grasp.radius <= bounds[tuple(sorted(grasp.faces))] * body.radius * (1 + 1e-6)
            tested += 1
    assert tested >= 80


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


class Looks(Stop):
    """An end after so many looks at the clock, which no clock decides."""

    def __init__(self, looks):
        super().__init__()
        self.looks = looks

    def __call__(self):
        self.looks -= 1
        return super().__call__() or self.looks < 0


def planned(body, request, stop, ranked=None):
    search = search_grasps(body, request, stop)
    return put_together(search, chosen(search, stop, ranked))


@pytest.fixture(scope="module")
def bar():
    body = example_object("double-wedge-bar")
    return body, {grasp.id for grasp in gc.plan(body)}


@pytest.mark.parametrize(
    ("limit", "looks"), [(None, 0), (None, 10), (None, 60), (6, 0), (6, 5), (6, 15)]
)
def test_a_plan_that_is_ended_early_keeps_what_it_found_and_says_so(bar, looks, limit):
    body, every = bar
    found = planned(body, PlanRequest(limit=limit), Looks(looks))
    assert found.ended == "time"
    assert {grasp.id for grasp in found} < every
    assert all(gc.force_closure(grasp).closed for grasp in found)
    assert (found.absence is None) == (len(found) > 0)
    assert found.absence is None or "proves nothing" in found.absence
    assert found.counts.families["free"].pruned == 0
    assert "ended early (time)" in repr(found)
    assert found.outcomes.held + found.outcomes.absent + found.outcomes.open == 70


@pytest.mark.parametrize("rank_by", get_args(RankBy))
def test_grasps_that_there_is_no_time_to_rank_come_last(bar, rank_by):
    body, every = bar
    ranked = []

    def tell(done, total):
        ranked.append((done, total))
        if done == 3:
            stop.now()

    stop = Stop()
    found = planned(body, PlanRequest(rank_by=rank_by), stop, ranked=tell)
    assert {grasp.id for grasp in found} == every
    if rank_by == "radius":
        assert (found.ended, ranked) == ("done", [])
    else:
        assert found.ended == "interrupt"
        assert ranked == [(done, len(every)) for done in (1, 2, 3)]


def test_what_is_undecided_stays_so_where_time_is_up(bar, monkeypatch):
    body, _ = bar
    usual, stop, completed = gc.plan(body, 0.3), Stop(), PlanSearch._completed

    def stopped(search):
        stop.now()
        return completed(search)

    monkeypatch.setattr(PlanSearch, "_completed", stopped)
    found = planned(body, PlanRequest(0.3, complete=True), stop)
    assert found.ended == "interrupt"
    assert found.undecided == usual.undecided
    assert len(found.undecided) == 8


def test_settings_that_were_keywords_still_are_and_a_warning_says_what_to_write():
    body = example_object("tetrahedron")
    wanted = r"settings=PlanSettings\(%s\)"
    with pytest.warns(DeprecationWarning, match=wanted % "cones='normal'") as warned:
        old = gc.plan(body, 0.6, limit=2, cones="normal")
    with pytest.warns(DeprecationWarning, match=wanted % "seed=3"):
        streamed = list(gc.iter_grasps(body, 0.6, seed=3))
    assert [each.filename for each in warned] == [__file__]
    assert old == gc.plan(body, 0.6, limit=2, settings=gc.PlanSettings(cones="normal"))
    assert streamed == list(gc.iter_grasps(body, settings=gc.PlanSettings(0.6, seed=3)))
    with pytest.raises(TypeError, match=r"plan\(\) got an unexpected keyword argument 'radius'"):
        gc.plan(body, radius=0.1)


def test_keywords_come_before_settings_and_grasps_that_stream_are_not_the_best():
    body = example_object("tetrahedron")
    settings = gc.PlanSettings(0.6, families=("free",), limit=2)
    found = gc.plan(body, 0.7, families="concurrent", settings=settings)
    assert (found.friction, len(found), found[0].family) == (0.7, 1, "concurrent")
    for best in (settings, gc.PlanSettings(rank_by="diverse")):
        with pytest.raises(gc.InputError, match="choose the best of all grasps"):
            gc.iter_grasps(body, settings=best)


def test_a_plan_ends_when_its_time_is_up():
    found = gc.plan(example_object("box"), settings=gc.PlanSettings(time_limit_s=0.0))
    assert (len(found), found.ended) == (0, "time")
    assert (
        gc.plan(example_object("box"), settings=gc.PlanSettings(time_limit_s=1e6)).ended == "done"
    )
