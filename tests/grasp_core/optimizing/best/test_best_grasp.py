"""The best grasp and its proof, against definitions, closed forms, brute force and tampering."""

import itertools
import threading
from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.optimizing.best import best_grasp as searching
from grasp_core.optimizing.best import search
from grasp_core.optimizing.best.grounds import exact_maps, grounds_of
from grasp_core.optimizing.best.incumbents import CLIMBED, climbed
from grasp_core.optimizing.best.proof_file import read_proof, write_proof
from grasp_core.optimizing.best.search import Searching, Stop
from scenes.example_objects import example_object
from tests.grasp_core.optimizing.best.independent_replay import replays
from tests.grasp_core.optimizing.best.supports_of_contacts import supports
from tests.marks import more

FRICTION = 0.5
CASES = {"tetrahedron": 0.1, "box": 0.2, "random-4-1": 0.4, "prism": 0.3}


@pytest.fixture(
    scope="module",
    params=[
        "tetrahedron",
        "random-4-1",
        pytest.param("box", marks=pytest.mark.slow),
        *more("prism"),
    ],
)
def searched(request):
    body = example_object(request.param)
    return body, gc.best_grasp(body, FRICTION, gap=CASES[request.param], jobs=2), request.param


def random_contacts(found, rng, count):
    """Pieces (count, 4) and plane coordinates (count, 4, 2), many of them on few faces."""
    grounds = found.proof.grounds
    on = rng.integers(len(grounds.counts), size=(count, 4))
    polygons = grounds.polygons()
    # sharp weights put many contacts at corners and edges
    at = [
        [
            rng.dirichlet(np.full(len(polygons[p]), rng.choice([0.1, 1.0]))) @ polygons[p]
            for p in row
        ]
        for row in on
    ]
    return on, np.array(at)


def test_the_gap_is_reached_and_the_proof_replays(searched):
    _, found, name = searched
    assert found.ended == "gap"
    assert 0.0 < found.gap <= CASES[name] + 1e-9
    assert found.verify()
    assert found.quality.lower <= found.bound


def test_the_grasp_is_on_the_object_clear_of_edges_and_in_force_closure(searched):
    body, found, _ = searched
    grasp = found.grasp
    assert gc.force_closure(grasp, friction=FRICTION).closed
    for face, point in zip(grasp.faces, grasp.positions, strict=True):
        polygon = body.faces[face].polygon
        along = np.roll(polygon, -1, axis=0) - polygon
        apart = np.linalg.norm(np.cross(point - polygon, along), axis=1)
        inner = apart / np.linalg.norm(along, axis=1)
        assert abs((point - polygon[0]) @ body.faces[face].normal) < 1e-9 * body.radius
        assert inner.min() > 0.0
        if len(body.faces[face].pieces) == 1:
            assert inner.min() > min(found.clearance, 0.5 * inner_radius(polygon)) - 1e-9


def inner_radius(polygon):
    """At most the radius of the largest disc, by the distances of the middle from the edges."""
    middle = polygon.mean(axis=0)
    along = np.roll(polygon, -1, axis=0) - polygon
    apart = np.linalg.norm(np.cross(middle - polygon, along), axis=1)
    return float((apart / np.linalg.norm(along, axis=1)).min())


def test_no_random_contacts_exceed_the_bound(searched):
    """A thousand twists bound the quality of most from above; the rest is measured."""
    _, found, _ = searched
    rng, measured = np.random.default_rng(1), 0
    twists = rng.normal(size=(300, 6))
    twists = np.vstack([twists / np.linalg.norm(twists, axis=1)[:, None], found.proof.twists[:300]])
    for _ in range(2):
        on, at = random_contacts(found, rng, 2000)
        upper = supports(found, on, at, twists).max(axis=1).min(axis=1)
        for row in np.argsort(-upper)[:25]:
            grounds = found.proof.grounds
            x = [grounds.places(p, y[None])[0] for p, y in zip(on[row], at[row], strict=True)]
            here = gc.ferrari_canny(
                np.array(x), grounds.normals[on[row]], FRICTION, torque_scale=1.0, gap=0.02
            )
            assert here.lower <= found.bound
            measured += here.lower > 0.0
    assert measured >= 15


def test_no_climb_ends_above_the_bound(searched):
    _, found, _ = searched
    hunt = Searching(found.proof.grounds, FRICTION, 1, Stop())
    rng, climbs = np.random.default_rng(2), 0
    on, at = random_contacts(found, rng, 400)
    twists = rng.normal(size=(200, 6))
    twists /= np.linalg.norm(twists, axis=1)[:, None]
    for row in np.argsort(-supports(found, on, at, twists).max(axis=1).min(axis=1))[:12]:
        end = climbed(hunt, on[row], at[row])
        assert end.quality.lower <= found.bound
        climbs += end.quality.lower > 0.0
    assert climbs >= 2


def test_the_best_on_a_tetrahedron_meets_the_ceiling_of_its_only_four_faces():
    """`quality_ceiling` bounds other contacts, one on each face, by another method."""
    body = example_object("tetrahedron")
    found = gc.best_grasp(body, FRICTION, gap=0.05, jobs=2)
    ceiling = gc.quality_ceiling(body, (0, 1, 2, 3), FRICTION, known=found.quality.lower, parts=400)
    assert found.quality.lower <= ceiling.upper
    assert sorted(found.grasp.faces) == [0, 1, 2, 3]
    assert found.gap <= 0.05


def test_without_friction_a_regular_tetrahedron_is_bounded_by_its_normals():
    """A closed form: twists without turning have support max_i n_i.v, at least 1/3 of |v| and, at
    v = -n_i, exactly 1/3, with contacts on all faces; friction mu adds at most mu |v|."""
    body = example_object("tetrahedron")
    for friction in (0.3, 0.5):
        found = gc.best_grasp(body, friction, gap=0.3)
        tangential = friction * np.sqrt(1.0 - 1.0 / 9.0)
        assert found.quality.lower <= 1.0 / 3.0 + tangential
        assert found.verify()


@pytest.mark.parametrize("name", ["tetrahedron", "random-4-1"])
def test_the_bound_holds_on_a_grid_of_all_contacts(name):
    """Brute force: all sets of four of the points of a grid on all faces, by 4,000 twists."""
    body = example_object(name)
    found = gc.best_grasp(body, FRICTION, gap=CASES[name])
    grounds, rows, points = found.proof.grounds, [], []
    for p, polygon in enumerate(grounds.polygons()):
        weights = [w for w in itertools.product(range(4), repeat=len(polygon)) if sum(w) == 3]
        for w in weights:
            rows.append(p)
            points.append(np.array(w) / 3.0 @ polygon)
    rng = np.random.default_rng(0)
    twists = rng.normal(size=(400, 6))
    twists = np.vstack([twists / np.linalg.norm(twists, axis=1)[:, None], found.proof.twists[:400]])
    each = supports(found, np.array(rows)[:, None], np.array(points)[:, None], twists)[:, 0]
    sets = np.array(list(itertools.combinations_with_replacement(range(len(rows)), 4)))
    upper = np.concatenate([each[k].max(axis=1).min(axis=1) for k in np.array_split(sets, 200)])
    best = 0.0
    for row in np.argsort(-upper)[:200]:
        if upper[row] <= best:
            break
        chosen = sets[row]
        x = np.array([grounds.places(rows[k], points[k][None])[0] for k in chosen])
        here = gc.ferrari_canny(
            x, grounds.normals[np.array(rows)[chosen]], FRICTION, torque_scale=1.0
        )
        best = max(best, here.lower)
    assert 0.0 < best <= found.bound
    assert best >= 0.3 * found.bound


def test_fractions_confirm_a_small_proof(tmp_path):
    """Exact arithmetic that shares no code with the package, on a proof without symmetries."""
    found = gc.best_grasp(example_object("random-4-1"), FRICTION, gap=0.5)
    path = write_proof(tmp_path / "proof.npz", found.proof)
    with np.load(path) as archive:
        arrays = dict(archive)
    assert len(arrays["deeds"]) > 10
    assert replays(arrays)
    assert not replays(arrays | {"threshold": 0.5 * arrays["threshold"]})
    assert not replays(arrays | {"deeds": arrays["deeds"][:-1], "asked": arrays["asked"][:-1]})


def test_a_file_holds_the_proof(searched, tmp_path):
    _, found, _ = searched
    again = read_proof(write_proof(tmp_path / "proof.npz", found.proof))
    assert again == found.proof
    assert again.verify()


def test_files_that_are_damaged_are_refused(tmp_path):
    found = gc.best_grasp(example_object("tetrahedron"), FRICTION, gap=0.4)
    path = write_proof(tmp_path / "proof.npz", found.proof)
    data = path.read_bytes()
    for broken in (b"", data[:200], data[:-30], b"x" + data[1:]):
        path.write_bytes(broken)
        with pytest.raises(gc.InputError, match=r"proof\.npz"):
            read_proof(path)


def test_the_proof_is_the_same_on_any_number_of_threads():
    body = example_object("box")
    one, two = (gc.best_grasp(body, FRICTION, gap=0.2, jobs=jobs) for jobs in (1, 3))
    assert one.proof == two.proof
    assert one.grasp == two.grasp


@pytest.mark.parametrize(
    "case",
    [
        ("tetrahedron", 0.1, "ferrari-canny"),
        ("octahedron", 0.3, "ferrari-canny"),
        ("tetrahedron", 0.2, "weight"),
        *more(("double-wedge-bar", 0.1, "ferrari-canny"), ("l-bracket", 0.2, "ferrari-canny")),
    ],
)
def test_corners_shaken_by_last_digits_give_the_same_grasp_and_proof(case):
    """Symmetric objects have equal twists and equal contacts, between which rounding may choose."""
    name, gap, measure = case
    body, rng = example_object(name), np.random.default_rng(0)
    shaken = body.vertices + 1e-15 * body.radius * rng.uniform(-1.0, 1.0, body.vertices.shape)
    other = gc.Polyhedron.from_mesh(shaken, body.triangles)
    assert (other.vertices != body.vertices).any()
    one, two = (gc.best_grasp(each, FRICTION, gap=gap, measure=measure) for each in (body, other))
    for field in ("deeds", "asked", "twists", "lines"):
        assert np.array_equal(getattr(one.proof, field), getattr(two.proof, field))
    assert one.grasp.faces == two.grasp.faces
    assert np.abs(one.grasp.positions - two.grasp.positions).max() < 1e-9 * body.radius
    assert one.bound == two.bound


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


def test_parts_that_leave_nodes_to_others_prove_as_much(monkeypatch):
    body = example_object("tetrahedron")
    whole = gc.best_grasp(body, FRICTION, gap=0.1)
    monkeypatch.setattr(search, "PART_NODES", 60)
    monkeypatch.setattr(search, "BUDGET", 10)
    one, two = (gc.best_grasp(body, FRICTION, gap=0.1, jobs=jobs) for jobs in (1, 2))
    assert one.proof == two.proof
    assert one.proof != whole.proof
    assert one.bound == whole.bound
    assert one.verify()


def test_a_search_of_too_many_nodes_ends_with_a_proved_bound(monkeypatch):
    monkeypatch.setattr(search, "MOST_NODES", 100)
    found = gc.best_grasp(example_object("tetrahedron"), FRICTION, gap=0.01, time_limit_s=120.0)
    assert found.ended == "undivided"
    assert 0.01 < found.gap < 1.0
    assert found.verify()


def test_a_time_limit_ends_the_search_with_a_proved_bound():
    found = gc.best_grasp(example_object("octahedron"), FRICTION, gap=0.001, time_limit_s=3.0)
    assert found.ended == "time"
    assert found.gap > 0.001
    assert found.verify()
    assert [now.bound for now in found.history] == sorted(
        (now.bound for now in found.history), reverse=True
    )


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


def test_a_proof_with_symmetries_and_one_without_bound_the_same_object(monkeypatch):
    body = example_object("tetrahedron")
    with_maps = gc.best_grasp(body, FRICTION, gap=0.3)
    monkeypatch.setattr(searching, "exact_maps", lambda *_: np.eye(3)[None])
    alone = gc.best_grasp(body, FRICTION, gap=0.3)
    assert len(with_maps.proof.maps) == 24
    assert len(alone.proof.maps) == 1
    assert alone.verify()
    assert with_maps.quality.lower <= alone.bound
    assert alone.quality.lower <= with_maps.bound


def test_false_maps_are_noticed():
    found = gc.best_grasp(example_object("random-4-1"), FRICTION, gap=0.5)
    turn = np.diag([-1.0, -1.0, 1.0])
    assert not replace(found.proof, maps=np.array([np.eye(3), turn])).verify()
    box = gc.best_grasp(example_object("box"), FRICTION, gap=0.4).proof
    assert box.verify()
    assert not replace(box, maps=box.maps[:3]).verify()
    assert not replace(box, maps=box.maps[::-1]).verify()


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"gap": 0.0}, "gap"), ({"gap": 1.0}, "gap"), ({"time_limit_s": -1.0}, "time_limit_s"),
        ({"measure": "volume"}, "measure"), ({"clearance": -1.0}, "clearance"),
        ({"jobs": 0}, "jobs"), ({"friction": -0.5}, "friction"),
    ],
)  # fmt: skip
def test_what_is_out_of_range_is_refused(changed, told):
    with pytest.raises(gc.InputError, match=told):
        gc.best_grasp(example_object("tetrahedron"), **({"friction": FRICTION} | changed))
