"""The best grasp and its proof, against definitions, closed forms, brute force and tampering."""

import itertools
import threading
from dataclasses import fields, replace

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.compiled import compiled
from grasp_core.objects.on_faces import within
from grasp_core.optimizing import ascent, search
from grasp_core.optimizing import best_grasp as searching
from grasp_core.optimizing.ascent import CLIMBED
from grasp_core.optimizing.contact_places import CORNER_ROOM, exact_maps, grounds_of
from grasp_core.optimizing.support_cuts import read_proof, write_proof
from grasp_core.quality.measures import Measure
from scenes.example_objects import example_object
from tests.grasp_core.bodies import from_edges
from tests.grasp_core.optimizing.contacts_on_faces import (
    FRICTION,
    best,
    demands,
    grid_of_contacts,
    measured,
    some_twists,
    supports,
    upper_bounds,
)
from tests.grasp_core.optimizing.independent_replay import replays
from tests.tampering.changes import forged

CASES = {
    ("tetrahedron", "ferrari-canny"): 0.1, ("tetrahedron", "weight"): 0.06,
    ("random-4-1", "task"): 0.3, ("box", "ferrari-canny"): 0.2,
}  # fmt: skip
"""Gaps, by object and measure; the first is searched every day."""
EASY, *HARD = CASES
EVERY = [EASY, *(pytest.param(case, marks=pytest.mark.slow) for case in HARD)]


@pytest.fixture(scope="module", params=EVERY, ids="-".join)
def searched(request):
    return example_object(request.param[0]), best(*request.param, CASES[request.param], jobs=2)


def easy():
    """What the first case finds."""
    return best(*EASY, CASES[EASY], jobs=2)


def test_the_gap_is_reached_and_the_proof_replays(searched):
    body, found = searched
    assert found.ended == "gap"
    assert 0.0 < found.gap <= CASES[body.name, found.measure] + 1e-9
    assert found.verify()
    assert found.quality.lower <= found.bound


def test_the_grasp_is_on_the_object_clear_of_edges_and_in_force_closure(searched):
    body, found = searched
    grasp = found.grasp
    assert gc.force_closure(grasp, friction=FRICTION).closed
    for face, point in zip(grasp.faces, grasp.positions, strict=True):
        polygon, normal = body.faces[face].polygon, body.faces[face].normal
        inner = from_edges(polygon, normal, point).min()
        assert abs((point - polygon[0]) @ normal) < 1e-9 * body.radius
        assert inner > 0.0
        if len(body.faces[face].pieces) == 1:
            widest = from_edges(polygon, normal, polygon.mean(axis=0)).min()  # at most
            assert inner > min(found.clearance, 0.5 * widest) - 1e-9


def test_the_best_on_a_tetrahedron_meets_the_ceiling_of_its_only_four_faces():
    """`quality_ceiling` bounds other contacts, one on each face, by another method."""
    found, body = easy(), example_object("tetrahedron")
    ceiling = gc.quality_ceiling(body, (0, 1, 2, 3), FRICTION, known=found.quality.lower, parts=400)
    assert found.quality.lower <= ceiling.upper
    assert sorted(found.grasp.faces) == [0, 1, 2, 3]


@pytest.mark.parametrize("case", [EVERY[0], EVERY[2]], ids="-".join)
def test_the_bound_holds_on_a_grid_of_all_contacts(case):
    """Brute force: all sets of four of the points of a grid on all faces, by several twists."""
    body, found = example_object(case[0]), best(*case, CASES[case], jobs=2)
    rows, points = grid_of_contacts(found)
    twists = some_twists(found, np.random.default_rng(0), 400)
    each = supports(found, rows[:, None], points[:, None], twists)[:, 0]
    sets = np.array(list(itertools.combinations_with_replacement(range(len(rows)), 4)))
    asked, largest = demands(found, twists, body.radius), 0.0
    upper = np.concatenate(
        [upper_bounds(each[k].max(axis=1), asked) for k in np.array_split(sets, 400)]
    )
    for row in np.argsort(-upper)[:200]:
        if upper[row] <= largest:
            break
        largest = max(largest, measured(found, rows[sets[row]], points[sets[row]]).lower)
    assert 0.3 * found.bound <= largest <= found.bound


AXES = np.vstack([np.eye(6), -np.eye(6)]) * np.repeat([1.0, 0.05], 3)
PROOFS = [
    ("random-4-1", 0.5, "ferrari-canny", None, 11),
    pytest.param("tetrahedron", 0.3, "task", AXES, 100, marks=pytest.mark.slow),
    pytest.param("box", 0.2, "weight", None, 5, marks=pytest.mark.slow),
]


@pytest.mark.parametrize(("name", "gap", "measure", "wrenches", "least"), PROOFS)
@pytest.mark.slow
def test_fractions_confirm_a_small_proof(
    name, gap, measure, wrenches, least, tmp_path, monkeypatch
):
    """Exact arithmetic that shares no code with the package, on a proof without symmetries."""
    monkeypatch.setattr(searching, "exact_maps", lambda *_: np.eye(3)[None])
    found = gc.best_grasp(
        example_object(name), FRICTION, gap=gap, measure=measure, wrenches=wrenches
    )
    path = write_proof(tmp_path / "proof.npz", found.proof)
    with np.load(path) as archive:
        arrays = dict(archive)
    assert len(arrays["deeds"]) >= least
    assert replays(arrays)
    assert not replays(arrays | {"threshold": 0.5 * arrays["threshold"]})
    assert not replays(arrays | {"deeds": arrays["deeds"][:-1], "asked": arrays["asked"][:-1]})


def test_a_file_holds_the_proof_and_the_loads(searched, tmp_path):
    _, found = searched
    again = read_proof(write_proof(tmp_path / "proof.npz", found.proof))
    assert again == found.proof
    assert again.verify()


def test_changed_proofs_are_refused(searched):
    _, found = searched
    proof, loads = found.proof, found.proof.measure.loads
    changes = [
        {"threshold": 0.5 * proof.threshold}, {"twists": 1.5 * proof.twists},
        {"lines": np.full((1, 3), 1e308)}, {"measure": forged(Measure("weight"), name="volume")},
    ]  # fmt: skip
    if found.measure == "task":
        # smaller loads are resisted in larger multiples
        changes += [{"measure": forged(proof.measure, loads=share * loads)} for share in (0.5, 0.0)]
    for change in changes:
        assert not forged(proof, **change).verify()
    for other in {"ferrari-canny", "weight"} - {found.measure}:
        assert not forged(found, proof=forged(proof, measure=Measure(other))).verify()
    quality = found.quality
    higher = forged(quality, lower=1.01 * quality.upper, upper=1.02 * quality.upper)
    assert not forged(found, quality=higher).verify()
    grounds, wrenches = proof.grounds, found.quality.wrenches
    none = {field.name: getattr(grounds, field.name)[:0] for field in fields(grounds)}
    assert not forged(proof, grounds=forged(grounds, **none)).verify()
    elsewhere = forged(proof, grounds=forged(grounds, corners=2.0 + grounds.corners))
    assert searching.are_contacts_of(found.grasp, wrenches, proof)
    assert not searching.are_contacts_of(found.grasp, wrenches, elsewhere)
    assert not searching.are_contacts_of(found.grasp, forged(wrenches, norm="linf"), proof)


def test_files_that_are_damaged_are_refused(tmp_path):
    path = write_proof(tmp_path / "proof.npz", easy().proof)
    data = path.read_bytes()
    for broken in (b"", data[:200], data[:-30], b"x" + data[1:]):
        path.write_bytes(broken)
        with pytest.raises(gc.InputError, match=r"proof\.npz"):
            read_proof(path)


def test_a_file_that_claims_another_bound_is_refused(tmp_path):
    path = write_proof(tmp_path / "proof.npz", easy().proof)
    with np.load(path) as archive:
        arrays = dict(archive)
    np.savez(path, **arrays | {"bound": 0.9 * arrays["bound"]})
    with pytest.raises(gc.InputError, match="bound must be the"):
        read_proof(path)


@pytest.mark.parametrize(
    ("name", "gap"),
    [("tetrahedron", 0.4), pytest.param("octahedron", 0.3, marks=pytest.mark.slow)],
)
@pytest.mark.slow
def test_corners_shaken_by_last_digits_give_the_same_grasp_and_proof(name, gap):
    """Symmetric objects have equal twists and equal contacts, between which rounding may choose."""
    body, rng = example_object(name), np.random.default_rng(0)
    shaken = body.vertices + 1e-15 * body.radius * rng.uniform(-1.0, 1.0, body.vertices.shape)
    other = gc.Polyhedron.from_mesh(shaken, body.triangles)
    assert (other.vertices != body.vertices).any()
    one, two = (gc.best_grasp(each, FRICTION, gap=gap) for each in (body, other))
    for field in ("deeds", "asked", "twists", "lines"):
        assert np.array_equal(getattr(one.proof, field), getattr(two.proof, field))
    assert one.grasp.faces == two.grasp.faces
    assert np.abs(one.grasp.positions - two.grasp.positions).max() < 1e-9 * body.radius
    assert one.bound == two.bound


@pytest.mark.slow
def test_contacts_that_no_learned_twist_refutes_are_divided(monkeypatch):
    """Rounding may decide where thresholds are tiny; the search must not ask for ever."""
    measured, places = search.Searching.measured, []

    def useless(self, on, at):
        found = measured(self, on, at)
        places.append((tuple(found.pieces), found.at.tobytes()))
        twist = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
        return replace(found, quality=replace(found.quality, direction=twist))

    monkeypatch.setattr(search.Searching, "measured", useless)
    found = gc.best_grasp(example_object("tetrahedron"), FRICTION, gap=0.02, time_limit_s=120.0)
    assert found.ended == "undivided"
    assert found.verify()
    in_a_row = [len(list(same)) for _, same in itertools.groupby(places)]
    assert max(in_a_row) == 2
    assert in_a_row.count(2) > CLIMBED  # more than climbs that stay where they begin


@pytest.mark.slow
def test_parts_that_leave_nodes_to_others_prove_as_much(monkeypatch):
    body, whole = example_object("tetrahedron"), easy()
    monkeypatch.setattr(search, "PART_NODES", 60)
    monkeypatch.setattr(search, "BUDGET", 10)
    one, two = (gc.best_grasp(body, FRICTION, gap=0.1, jobs=jobs) for jobs in (1, 2))
    assert one.proof == two.proof
    assert one.proof != whole.proof
    assert one.bound == whole.bound
    assert one.verify()


def test_a_search_of_too_many_nodes_ends_with_a_proved_bound(monkeypatch):
    monkeypatch.setattr(search, "MOST_SEARCHED", 100)
    found = gc.best_grasp(example_object("tetrahedron"), FRICTION, gap=0.01, time_limit_s=120.0)
    assert found.ended == "undivided"
    assert 0.01 < found.gap < 1.0
    assert found.verify()


@pytest.mark.slow
def test_objects_without_contacts_in_closure_or_with_too_many_faces_are_named(monkeypatch):
    with pytest.raises(gc.InputError, match=r"1 to 128 convex pieces .* got 200"):
        gc.best_grasp(example_object("random-200-1"), FRICTION)
    monkeypatch.setattr(ascent, "MOST_RATED", 0)
    with pytest.raises(gc.InputError, match="found none of box; raise the friction"):
        gc.best_grasp(example_object("box"), 1e-3)


@pytest.mark.slow
def test_better_contacts_that_a_search_meets_become_the_best(monkeypatch):
    """It begins with random contacts that have not climbed."""
    body, gap = example_object("tetrahedron"), 0.3
    monkeypatch.setattr(ascent, "climbed", lambda search, on, at: search.measured(on, at))
    monkeypatch.setattr(ascent, "CLIMBED", 1)
    found = gc.best_grasp(body, FRICTION, gap=gap)
    assert found.history[0].quality < 0.9 * found.quality.lower
    assert found.verify()
    assert found.gap <= gap


def test_contacts_may_be_on_the_pieces_of_faces_that_are_not_convex():
    body = example_object("l-bracket")
    grounds = grounds_of(body, 0.05 * body.radius)
    assert len(grounds.counts) > len(body.faces)
    for p, polygon in enumerate(grounds.polygons()):
        face = body.faces[grounds.faces[p]]
        for corner in grounds.places(p, polygon) * body.radius + body.center_of_mass:
            assert any(within(corner, piece, face.normal, 1e-9) for piece in face.pieces)


def test_a_time_limit_ends_the_search_with_a_proved_bound():
    found = gc.best_grasp(example_object("tetrahedron"), FRICTION, gap=0.001, time_limit_s=0.0)
    assert found.ended == "time"
    assert found.gap > 0.001
    assert found.verify()
    bounds = [now.bound for now in found.history]
    assert bounds == sorted(bounds, reverse=True)


def test_without_time_only_the_first_contacts_in_force_closure_climb(monkeypatch):
    climbs, measured = [], []
    climbed, quality = ascent.climbed, ascent.wrench_set_quality
    monkeypatch.setattr(ascent, "climbed", lambda *a: climbs.append(a) or climbed(*a))
    monkeypatch.setattr(
        ascent, "wrench_set_quality", lambda *a: measured.append(quality(*a)) or measured[-1]
    )
    gc.best_grasp(example_object("wedge"), FRICTION, time_limit_s=0.0)
    assert len(climbs) == 1
    closed = [each.lower > 0.0 for each in measured]
    assert closed.index(True) == len(closed) - 2  # it is measured once more before it climbs


def test_an_interrupt_ends_the_search_with_a_proved_bound(monkeypatch):
    calls = []

    def interrupting(self, *arguments):
        calls.append(threading.current_thread())
        if len(calls) > 1:
            raise KeyboardInterrupt
        return refute(self, *arguments)

    refute = searching.Searching.refute
    monkeypatch.setattr(searching.Searching, "refute", interrupting)
    found = gc.best_grasp(example_object("tetrahedron"), FRICTION, gap=0.01)
    assert found.ended == "interrupt"
    assert found.verify()


def test_symmetries_are_used_only_where_they_form_a_group():
    counts = {}
    for name in ("tetrahedron", "box", "octahedron", "random-4-1"):
        body = example_object(name)
        counts[name] = len(exact_maps(body, grounds_of(body, 0.05 * body.radius)))
    assert counts == {"tetrahedron": 24, "box": 8, "octahedron": 48, "random-4-1": 1}


def test_false_maps_are_noticed():
    proof = easy().proof
    turn = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # of a box, not of these
    assert len(proof.maps) == 24
    for maps in (np.array([np.eye(3), turn]), proof.maps[1:], proof.maps[::-1]):
        assert not replace(proof, maps=maps).verify()


def test_a_cut_keeps_all_that_answers_and_next_to_nothing_else():
    """The cone's support from its definition, at corners and near those on the border."""
    body, rng, cut_at = example_object("wedge"), np.random.default_rng(5), 0
    grounds, kernel = grounds_of(body, 0.05 * body.radius), compiled(search.REPLAY)
    pieces = kernel.Pieces(grounds.normals, grounds.origins, grounds.frames, FRICTION)
    for _ in range(400):
        p, y, t = int(rng.integers(len(grounds.counts))), rng.normal(size=6), rng.normal()
        polygon, at, out = grounds.polygons()[p], np.empty(6), np.empty((CORNER_ROOM, 2))
        kernel.slopes(pieces, p, y, at)
        kept = kernel.cut(np.array(polygon), len(polygon), at, FRICTION, t, out)

        def reached(places, p=p, y=y):
            return grounds.supports(np.full(len(places), p), places, FRICTION, y[None])[:, 0]

        answering = reached(polygon) >= t
        assert (kept > 0) == answering.any()
        new = np.array([q for q in out[:kept] if not (q == polygon).all(axis=1).any()])
        assert kept == answering.sum() + len(new)
        for q in new:
            # below the threshold but for rounding, and no farther from it than doubles tell
            assert -1e-11 < reached(q[None])[0] - t < 1e-14
            cut_at += 1
    assert cut_at >= 200
