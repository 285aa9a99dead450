"""The best grasps for the weight and for tasks, against definitions, closed forms and tampering."""

import itertools
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.closure.wrench_sets import WrenchSet
from grasp_core.compiled import compiled
from grasp_core.optimizing.ascent import _weakest
from grasp_core.optimizing.best import best_grasp as searching
from grasp_core.optimizing.best.grounds import exact_maps, grounds_of
from grasp_core.optimizing.best.proof_file import read_proof, write_proof
from grasp_core.optimizing.best.search import Searching, Stop
from grasp_core.optimizing.best.support_cuts import ROUNDING
from grasp_core.quality.measures import Measure, ResistedLoads, resisted_loads
from scenes.example_objects import example_object
from tests.grasp_core.optimizing.best.independent_replay import replays
from tests.grasp_core.optimizing.best.supports_of_contacts import supports
from tests.marks import more

FRICTION = 0.5
LIFT = np.array(
    [[0.0, 0.0, -3.0, 0.0, 0.0, 0.0], [1.0, 0.0, -3.0, 0.0, 0.02, 0.0],
     [0.0, 0.0, 0.0, 0.0, 0.0, 0.1]]
)  # fmt: skip
"""A task: an object of three newtons that is lifted, lifted and pushed, and unscrewed."""
CASES = {
    ("tetrahedron", "weight"): 0.06, ("random-4-1", "weight"): 0.1,
    ("tetrahedron", "task"): 0.2, ("random-4-1", "task"): 0.3,
}  # fmt: skip


@cache
def best(name, measure, **settings):
    wrenches = LIFT if measure == "task" else None
    body = example_object(name)
    return gc.best_grasp(body, FRICTION, measure=measure, wrenches=wrenches, **settings)


def loosely_bounded():
    return best("tetrahedron", "weight", gap=0.3)


@pytest.fixture(
    scope="module",
    params=[
        ("tetrahedron", "weight"),
        ("random-4-1", "task"),
        *more(("tetrahedron", "task"), ("random-4-1", "weight")),
    ],
    ids="-".join,
)
def searched(request):
    return best(*request.param, gap=CASES[request.param]), request.param


def measured(found, on, at):
    """The measure of contacts on pieces (4,) at plane coordinates (4, 2), with a rough gap."""
    grounds = found.proof.grounds
    x = np.array([grounds.places(p, y[None])[0] for p, y in zip(on, at, strict=True)])
    wrenches = WrenchSet.at(x, grounds.normals[on], np.full(4, FRICTION))
    return resisted_loads(wrenches, found.proof.measure, 0.02)


def demands(found, twists):
    """How much of the loads twists ask for, by the definition, (n,)."""
    if found.measure == "weight":
        return np.linalg.norm(twists[:, :3], axis=1)
    loads = LIFT / np.repeat([1.0, radius(found)], 3)
    return np.array([max(0.0, *(-load @ y for load in loads)) for y in twists])


def radius(found):
    """The object's radius, by the size of the grasp beside that of its proof."""
    arms = found.quality.wrenches.G.reshape(2, 3, 4, 3).transpose(0, 2, 1, 3)
    turns = arms[1] @ arms[0].transpose(0, 2, 1)
    places = np.stack([turns[:, 2, 1], turns[:, 0, 2], turns[:, 1, 0]], axis=1)
    apart = [np.linalg.norm(x[0] - x[1]) for x in (found.grasp.positions, places)]
    return apart[0] / apart[1]


def some_twists(found, rng, count):
    y = rng.normal(size=(count, 6))
    return np.vstack([y / np.linalg.norm(y, axis=1)[:, None], found.proof.twists[:count]])


def upper_bounds(each, asked):
    """What twists allow of the largest of the contacts' supports, (..., n) each."""
    with np.errstate(divide="ignore", invalid="ignore"):
        allowed = np.where(asked > 0.0, each / asked, np.inf)
    return np.where(each < 0.0, -1.0, allowed).min(axis=-1)


def test_the_gap_is_reached_and_the_proof_replays(searched):
    found, case = searched
    assert found.ended == "gap"
    assert found.measure == case[1]
    assert 0.0 < found.gap <= CASES[case] + 1e-9
    assert found.verify()
    assert found.quality.lower <= found.bound
    assert gc.force_closure(found.grasp, friction=FRICTION).closed


def test_no_random_contacts_exceed_the_bound(searched):
    found, _ = searched
    rng, count = np.random.default_rng(1), 0
    grounds = found.proof.grounds
    polygons = grounds.polygons()
    twists = some_twists(found, rng, 300)
    asked = demands(found, twists)
    on = rng.integers(len(polygons), size=(6000, 4))
    at = np.array(
        [
            [
                rng.dirichlet(np.full(len(polygons[p]), rng.choice([0.1, 1.0]))) @ polygons[p]
                for p in row
            ]
            for row in on
        ]
    )
    upper = upper_bounds(supports(found, on, at, twists).max(axis=1), asked)
    for row in np.argsort(-upper)[:60]:
        here = measured(found, on[row], at[row])
        assert here.lower <= found.bound
        count += here.lower > 0.0
    assert count >= 15


@pytest.mark.parametrize("measure", ["task", *more("weight")])
def test_the_bound_holds_on_a_grid_of_all_contacts(measure):
    """Brute force: all sets of four of the points of a grid on all faces, by several twists."""
    found = best("random-4-1", measure, gap=CASES["random-4-1", measure])
    grounds, rows, points = found.proof.grounds, [], []
    for p, polygon in enumerate(grounds.polygons()):
        weights = [w for w in itertools.product(range(4), repeat=len(polygon)) if sum(w) == 3]
        for w in weights:
            rows.append(p)
            points.append(np.array(w) / 3.0 @ polygon)
    rows, points = np.array(rows), np.array(points)
    twists = some_twists(found, np.random.default_rng(0), 400)
    each = supports(found, rows[:, None], points[:, None], twists)[:, 0]
    sets = np.array(list(itertools.combinations_with_replacement(range(len(rows)), 4)))
    asked = demands(found, twists)
    upper = np.concatenate(
        [upper_bounds(each[k].max(axis=1), asked) for k in np.array_split(sets, 400)]
    )
    largest = 0.0
    for row in np.argsort(-upper)[:150]:
        if upper[row] <= largest:
            break
        here = measured(found, rows[sets[row]], points[sets[row]])
        largest = max(largest, here.lower)
    assert 0.3 * found.bound <= largest <= found.bound


@pytest.mark.parametrize("friction", [FRICTION, *more(0.3)])
def test_a_regular_tetrahedron_holds_a_weight_known_by_its_normals(friction):
    """Forces along the normals at the middles of faces make a hull with a ball of radius 1/3. In
    the direction against a normal no contact of the other faces pushes more than 1/3, and friction
    adds the sine of the angle between them, which no torque can raise."""
    if friction == FRICTION:
        found = loosely_bounded()
    else:
        found = gc.best_grasp(example_object("tetrahedron"), friction, gap=0.3, measure="weight")
    most = 1.0 / 3.0 + friction * np.sqrt(8.0 / 9.0)
    assert 1.0 / 3.0 <= found.quality.lower <= most
    assert found.bound <= 1.01 * most
    assert found.verify()


@pytest.mark.parametrize("measure", ["task", pytest.param("weight", marks=pytest.mark.slow)])
def test_fractions_confirm_a_small_proof(measure, tmp_path, monkeypatch):
    """Exact arithmetic that shares no code with the package, on a proof without symmetries."""
    monkeypatch.setattr(searching, "exact_maps", lambda *_: np.eye(3)[None])
    if measure == "weight":
        found, least = best.__wrapped__("box", "weight", gap=0.2), 5
    else:
        axes = np.vstack([np.eye(6), -np.eye(6)]) * np.repeat([1.0, 0.05], 3)
        body, least = example_object("tetrahedron"), 100
        found = gc.best_grasp(body, FRICTION, gap=0.3, measure="task", wrenches=axes)
    path = write_proof(tmp_path / "proof.npz", found.proof)
    with np.load(path) as archive:
        arrays = dict(archive)
    assert len(arrays["deeds"]) >= least
    assert replays(arrays)
    assert not replays(arrays | {"threshold": 0.5 * arrays["threshold"]})
    assert not replays(arrays | {"deeds": arrays["deeds"][:-1], "asked": arrays["asked"][:-1]})


def test_a_file_holds_the_proof_and_the_loads(searched, tmp_path):
    found, case = searched
    path = write_proof(tmp_path / "proof.npz", found.proof)
    with np.load(path) as archive:
        assert archive["schema"] == 2
        assert str(archive["measure"]) == case[1]
    again = read_proof(path)
    assert again == found.proof
    assert again.verify()


@pytest.mark.parametrize(
    "changed", [{"measure": "volume"}, {"measure": "ferrari-canny"}, {"measure": "task"},
                {"loads": np.ones((1, 6))}, {"loads": np.ones(6)}, {"schema": 3}],
)  # fmt: skip
def test_files_with_other_loads_are_refused(changed, tmp_path):
    path = write_proof(tmp_path / "proof.npz", loosely_bounded().proof)
    with np.load(path) as archive:
        arrays = dict(archive) | changed
    np.savez(path, **arrays)
    with pytest.raises(gc.InputError):
        read_proof(path)


def test_changed_proofs_are_refused(searched):
    found, case = searched
    proof = found.proof
    usual = Measure("ferrari-canny")
    assert not replace(proof, threshold=0.5 * proof.threshold).verify()
    assert not replace(found, proof=replace(proof, measure=usual)).verify()
    assert not replace(proof, twists=1.5 * proof.twists).verify()
    assert not replace(proof, measure=Measure("volume")).verify()
    if case[1] == "task":
        loads = proof.measure.loads
        # smaller loads are resisted in larger multiples
        assert not replace(proof, measure=Measure("task", 0.5 * loads)).verify()
        assert not replace(proof, measure=Measure("task", 0.0 * loads)).verify()
        assert not replace(found, proof=replace(proof, measure=Measure("weight"))).verify()
    quality = found.quality
    assert isinstance(quality, ResistedLoads)
    higher = replace(quality, lower=1.01 * quality.upper, upper=1.02 * quality.upper)
    assert not replace(found, quality=higher).verify()


def test_a_task_keeps_only_the_symmetries_that_it_has():
    body = example_object("box")
    grounds = grounds_of(body, 0.05 * body.radius)
    down, turning = np.zeros((1, 6)), np.zeros((1, 6))
    down[0, 2], turning[0, 5] = -1.0, 1.0
    # of eight maps of a box, four keep a direction along an axis; of these the two reflections
    # turn a torque about the axis round
    assert len(exact_maps(body, grounds)) == 8
    assert len(exact_maps(body, grounds, Measure("weight"))) == 8
    assert len(exact_maps(body, grounds, Measure("task", down))) == 4
    assert len(exact_maps(body, grounds, Measure("task", np.vstack([down, turning])))) == 2
    found = best("box", "task", gap=0.4)
    every = exact_maps(body, grounds)
    assert len(every) > len(found.proof.maps)
    assert not replace(found.proof, maps=every).verify()


def test_twists_that_ask_for_nothing_leave_room_for_rounding():
    """Support zero is an answer to a twist without a force, and minus the rounding still is."""
    found = loosely_bounded()
    proof = found.proof
    at = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0])
    ask = replace(
        proof, deeds=np.zeros(1, int), asked=np.zeros(1, int), twists=at[None], maps=np.eye(3)[None]
    )
    assert not ask.verify()
    answers = ask.threshold * ask.measure.demands(ask.twists) - ask._slack.lowered
    assert answers == pytest.approx([-(1.0 + FRICTION) * ROUNDING], rel=1e-12)
    assert ask.bound == ask.threshold


@pytest.mark.parametrize("measure", [Measure("weight"), Measure("task", LIFT)])
def test_compiled_demands_are_those_of_the_definition(measure):
    body = example_object("tetrahedron")
    search = Searching(grounds_of(body, 0.05 * body.radius), FRICTION, 1, Stop(), measure)
    rng, kernel, hardest = np.random.default_rng(4), compiled(TWISTS), np.empty(6)
    twists = rng.normal(size=(200, 6))
    for y in twists:
        asked = kernel.demanded(search.demand, y, hardest)
        assert asked == pytest.approx(float(measure.demands(y[None])[0]), abs=1e-13)
        assert asked == pytest.approx(max(hardest @ y, 0.0), abs=1e-13)


TWISTS = "grasp_core.optimizing.best.twists_kernel"


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"measure": "task"}, "wrenches"), ({"measure": "weight", "wrenches": LIFT}, "wrenches"),
        ({"wrenches": LIFT}, "wrenches"), ({"measure": "task", "wrenches": LIFT[0]}, "wrenches"),
        ({"measure": "task", "wrenches": 0.0 * LIFT}, "wrenches"),
        ({"measure": "task", "wrenches": LIFT[:0]}, "wrenches"),
        ({"measure": "task", "wrenches": np.ones((101, 6))}, "wrenches"),
        ({"measure": "lift"}, "measure"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused(changed, told):
    with pytest.raises(gc.InputError, match=told):
        gc.best_grasp(example_object("tetrahedron"), FRICTION, **changed)


def test_weak_directions_are_ordered_without_last_digits():
    """The eight facets of an octahedron hold as much as each other, however long normals are."""
    places = np.vstack([np.eye(3), -np.eye(3)])
    wrenches = WrenchSet.at(places, -places, np.full(6, 0.3))
    found = resisted_loads(wrenches, Measure("weight"), 1e-3)
    signs = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    facing, rng = np.hstack([signs, np.zeros((8, 3))]), np.random.default_rng(0)
    for _ in range(8):
        normals = rng.uniform(0.5, 2.0, size=(8, 1)) * facing
        polytope = replace(found.ball.polytope, normals=normals)
        again = _weakest(replace(found, ball=replace(found.ball, polytope=polytope)))
        assert np.abs(again + signs / np.sqrt(3.0)).max() <= 1e-12
