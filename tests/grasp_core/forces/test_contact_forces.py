import math

import clarabel
import numpy as np
import pytest
from scipy import sparse
from scipy.optimize import nnls

import grasp_core as gc
from grasp_core.closure.wrenches import contact_frames, grasp_map, normal_and_tangential
from grasp_core.cones.pyramids import PYRAMID_SIDES
from grasp_core.forces import contact_forces as forces_module
from grasp_core.forces.balance import Balance
from grasp_core.forces.cone_forces import least_norm_in_cones
from grasp_core.forces.contact_forces import (
    NoForcesError,
    closest_forces,
    contact_forces,
    least_friction_forces,
)
from grasp_core.quality.wrench_limits import WrenchBody, axis_wrenches
from grasp_core.solvers import nearest_point as least_distance_module
from scenes.example_objects import example_object
from tests.judges import TETRA_CENTERS, TETRA_NORMALS, random_contacts

LIMITS = (0.05, 10.0)
SLACK = 1e-5
"""Ten times the residual at which forces are accepted, for forces of ten newtons."""
INSCRIBED = math.cos(math.pi / PYRAMID_SIDES)
ALL_LIMITS = [(0.0, math.inf), (0.0, 10.0), LIMITS, (1.0, 10.0), (0.5, math.inf)]


def cases(per_object=4):
    """Grasps with wrenches at 0.8 of what they resist at friction 0.5."""
    for name in ("wedge", "dodecahedron", "random-20-7", "screwdriver"):
        body = example_object(name)
        for grasp in gc.plan(body, 0.5, limit=per_object, cones="normal").grasps:
            resisted = WrenchBody(
                grasp.positions - body.center_of_mass, grasp.normals, np.full(4, 0.5), LIMITS[1]
            )
            for wrench in axis_wrenches(body.radius):
                yield body, grasp, 0.8 * resisted.limit(wrench).limit * wrench


def imbalance(grasp, forces, wrench, center):
    return grasp_map(grasp.positions, center) @ forces.ravel() + wrench


def test_forces_balance_within_cones_and_limits():
    tested = 0
    for body, grasp, wrench in cases():
        center = body.center_of_mass
        forces, needed = least_friction_forces(
            grasp.positions, grasp.normals, 0.5, wrench, normal_force=LIMITS, center=center
        )
        along, across = normal_and_tangential(forces, grasp.normals)
        assert np.abs(imbalance(grasp, forces, wrench, center)).max() < SLACK
        assert LIMITS[0] - SLACK <= along.min()
        assert along.max() <= LIMITS[1] + SLACK
        assert (across / along).max() == pytest.approx(needed, rel=1e-9)
        assert needed < 0.5
        tested += 1
    assert tested >= 150


def test_least_friction_is_near_the_true_minimum():
    """The true one by bisection on exact cones without a lower limit, which can only be less.

    Pyramids of 16 sides alone would miss it by up to 2 %.
    """
    tested = 0
    for body, grasp, wrench in cases(per_object=1):
        arms = grasp.positions - body.center_of_mass
        lower, upper = 0.0, 0.5
        for _ in range(20):
            middle = 0.5 * (lower + upper)
            limit = WrenchBody(arms, grasp.normals, np.full(4, middle), LIMITS[1]).limit(wrench)
            lower, upper = (lower, middle) if limit.limit >= 1.0 else (middle, upper)
        _, needed = least_friction_forces(
            grasp.positions, grasp.normals, 0.5, wrench,
            normal_force=(0.0, LIMITS[1]), center=body.center_of_mass,
        )  # fmt: skip
        assert lower * (1 - 1e-3) <= needed <= upper * (1 + 5e-3) + 1e-5
        tested += 1
    assert tested >= 40


def test_least_norm_forces_are_no_larger_than_others():
    tested = 0
    for body, grasp, wrench in cases(per_object=1):
        center = body.center_of_mass
        limits = {"normal_force": LIMITS, "center": center}
        small = contact_forces(grasp, None, 0.5, wrench, **limits)
        steady, _ = least_friction_forces(grasp.positions, grasp.normals, 0.5, wrench, **limits)
        assert np.linalg.norm(small) <= np.linalg.norm(steady) * (1 + 1e-3)
        assert np.abs(imbalance(grasp, small, wrench, center)).max() < SLACK
        along, across = normal_and_tangential(small, grasp.normals)
        assert (across <= 0.5 * along + SLACK).all()
        tested += 1
    assert tested >= 40


def test_a_push_on_a_tetrahedron_is_shared_by_symmetry():
    """A force along an inward normal is taken by the other three contacts, equally up to the
    1.9 % that the pyramids' sixteen sides give away.
    """
    wrench = np.append(3.0 * TETRA_NORMALS[0], np.zeros(3))
    forces = contact_forces(TETRA_CENTERS, TETRA_NORMALS, 0.5, wrench)
    along, _ = normal_and_tangential(forces, TETRA_NORMALS)
    np.testing.assert_allclose(along[1:], along[1], rtol=0.02)
    assert along[0] == pytest.approx(0.0, abs=1e-5)
    np.testing.assert_allclose(forces.sum(axis=0), -wrench[:3], atol=1e-6)


def test_a_wrench_beyond_the_limit_has_no_forces():
    body = example_object("wedge")
    grasp = gc.plan(body, 0.5, limit=1).grasps[0]
    with pytest.raises(NoForcesError, match="no forces were found"):
        contact_forces(grasp, None, 0.5, [100.0, 0, 0, 0, 0, 0], normal_force=(0.0, 10.0))


def test_closest_forces_stay_in_their_cones():
    tested = 0
    for body, grasp, wrench in cases(per_object=1):
        forces = closest_forces(
            grasp.positions, grasp.normals, 0.2, 5.0 * wrench,
            normal_force=LIMITS, center=body.center_of_mass,
        )  # fmt: skip
        along, across = normal_and_tangential(forces, grasp.normals)
        assert (across <= 0.2 * along + SLACK).all()
        tested += 1
    assert tested >= 40


@pytest.mark.parametrize("limits", [(-1.0, 2.0), (2.0, 1.0), (math.nan, 1.0)])
def test_bad_limits_are_refused(limits):
    with pytest.raises(gc.InputError, match="normal_force must be"):
        contact_forces(TETRA_CENTERS, TETRA_NORMALS, 0.5, np.ones(6), normal_force=limits)


def balanced_wrenches(rng, positions, normals, friction, limits, count):
    """Wrenches that forces inside the pyramids and between the limits balance, (count, 6).

    Args:
        positions: (k, 3)
        normals: (k, 3)
        friction: (k,)
        limits: Of the normal forces.
        count: How many.
    """
    size = (count, len(positions))
    along = rng.uniform(limits[0], min(limits[1], limits[0] + 5.0), size)
    across = 0.98 * INSCRIBED * friction * along * np.sqrt(rng.uniform(size=size))
    turns = rng.uniform(0.0, 2.0 * np.pi, size)
    local = np.stack([along, across * np.cos(turns), across * np.sin(turns)], axis=2)
    forces = np.einsum("kij,nkj->nki", contact_frames(normals), local)
    return -forces.reshape(count, -1) @ grasp_map(positions).T


def batches(count, wrenches):
    """Random contacts with frictions, limits, and loads: scattered, on a path, and with repeats."""
    rng = np.random.default_rng(8)
    for trial in range(count):
        positions, normals = random_contacts(rng, 2 + trial % 5)
        friction = rng.uniform(0.1, 1.0, len(positions))
        limits = ALL_LIMITS[trial % len(ALL_LIMITS)]
        ends = balanced_wrenches(rng, positions, normals, friction, limits, wrenches)
        path = np.linspace(ends[0], ends[1], wrenches)
        yield positions, normals, friction, limits, np.vstack([ends, path, ends[:2]])


def pyramid_program(positions, normals, friction, limits):
    """Map A and rows with A f = -w, rows @ f <= bounds, as `contact_forces` states them.

    Forces are in the frame of the positions, (3k,).
    """
    turns = 2.0 * np.pi * (np.arange(PYRAMID_SIDES) + 0.5) / PYRAMID_SIDES
    sides = [
        np.outer(np.cos(turns), frame[:, 1])
        + np.outer(np.sin(turns), frame[:, 2])
        - mu * INSCRIBED * frame[:, 0]
        for frame, mu in zip(contact_frames(normals), friction, strict=True)
    ]
    pushes = sparse.block_diag([normal[None] for normal in normals]).toarray()
    rows, bounds = [sparse.block_diag(sides).toarray(), -pushes], [0.0, -limits[0]]
    if math.isfinite(limits[1]):
        rows, bounds = [*rows, pushes], [*bounds, limits[1]]
    bounds = np.concatenate([np.full(len(r), b) for r, b in zip(rows, bounds, strict=True)])
    return grasp_map(positions), np.vstack(rows), bounds


def kkt_residual(program, wrench, forces):
    """How far forces are from feasible and from least norm, over the size of the forces.

    The gradient f must be -A'y - rows'u with u >= 0 on the rows that hold with equality.
    """
    A, rows, bounds = program
    f = forces.ravel()
    size = np.abs(f).max()
    if size == 0.0:
        return max(np.abs(wrench).max(), -bounds.min())
    slack = bounds - rows @ f
    active = rows[slack <= 1e-9 * size]
    _, off = nnls(np.hstack([A.T, -A.T, active.T]), -f)
    return max(off, np.abs(A @ f + wrench).max(), -slack.min()) / size


def clarabel_least_norm(program, wrench):
    """The same program by an interior-point method."""
    A, rows, bounds = program
    n = A.shape[1]
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-12
    return np.array(
        clarabel.DefaultSolver(
            sparse.identity(n, format="csc"), np.zeros(n),
            sparse.csc_matrix(np.vstack([A, rows])), np.concatenate([-wrench, bounds]),
            [clarabel.ZeroConeT(6), clarabel.NonnegativeConeT(len(rows))], settings,
        ).solve().x
    ).reshape(-1, 3)  # fmt: skip


def count_calls(monkeypatch, module, name):
    """Counts calls of a module's function; the list grows by one each."""
    calls, function = [], getattr(module, name)

    def counted(*args, **kwargs):
        calls.append(name)
        return function(*args, **kwargs)

    monkeypatch.setattr(module, name, counted)
    return calls


@pytest.mark.parametrize(
    ("objective", "count", "wrenches"), [("least_norm", 30, 12), ("least_friction", 10, 4)]
)
def test_a_batch_equals_its_single_calls_in_any_order(objective, count, wrenches):
    """To 1e-9 of the largest force. Least friction is found by the same steps, bit for bit."""
    tested = 0
    for positions, normals, friction, limits, loads in batches(count, wrenches):
        options = {"objective": objective, "normal_force": limits}
        together = contact_forces(positions, normals, friction, loads, **options)
        backwards = contact_forces(positions, normals, friction, loads[::-1], **options)[::-1]
        alone = [contact_forces(positions, normals, friction, load, **options) for load in loads]
        assert together.shape == (len(loads), len(positions), 3)
        for one, other, single in zip(together, backwards, alone, strict=True):
            near = 1e-9 * np.abs(single).max()
            np.testing.assert_allclose(one, single, rtol=0.0, atol=near)
            np.testing.assert_allclose(other, single, rtol=0.0, atol=near)
            tested += 1
    assert tested == count * (2 * wrenches + 2)


def nothing_proved(C, D, _):
    return np.zeros((len(D), C.shape[1])), np.zeros(len(D), dtype=bool)


def test_every_least_norm_answer_is_optimal_and_few_on_a_path_need_a_program(monkeypatch):
    """By the conditions of optimality, with multipliers found here; without the kernel."""
    monkeypatch.setattr(least_distance_module, "_by_kernel", nothing_proved)
    programs = count_calls(monkeypatch, least_distance_module, "_weights")
    proxqp = count_calls(monkeypatch, forces_module, "_solve")
    tested = 0
    for positions, normals, friction, limits, loads in batches(25, 20):
        program = pyramid_program(positions, normals, friction, limits)
        forces = contact_forces(positions, normals, friction, loads, normal_force=limits)
        for load, answer in zip(loads, forces, strict=True):
            assert kkt_residual(program, load, answer) < 1e-9
            tested += 1
    print(f"{tested} answers by {len(programs)} programs")
    assert tested == 25 * 42
    assert len(programs) < 0.9 * tested
    assert not proxqp

    positions, normals, friction, limits, loads = next(batches(1, 2))
    programs.clear()
    path = np.linspace(loads[0], loads[1], 500)
    contact_forces(positions, normals, friction, path, normal_force=limits)
    assert len(programs) < 50


def test_least_norm_agrees_with_an_interior_point_method():
    tested = 0
    for positions, normals, friction, limits, loads in batches(25, 4):
        program = pyramid_program(positions, normals, friction, limits)
        forces = contact_forces(positions, normals, friction, loads, normal_force=limits)
        for load, answer in zip(loads, forces, strict=True):
            expected = clarabel_least_norm(program, load)
            np.testing.assert_allclose(answer, expected, atol=1e-6 * np.abs(expected).max())
            tested += 1
    assert tested == 250


def test_balanced_wrenches_of_any_size_get_forces_at_any_friction():
    """Of least norm, though some of these programs are nearly without interior."""
    rng = np.random.default_rng(4)
    tested = 0
    for friction in (0.0, 1e-6, 1e-3, 0.1, 1.0, 10.0):
        for limits in ALL_LIMITS:
            for size in (1.0, 1e-9) if limits[0] == 0.0 else (1.0,):
                positions, normals = random_contacts(rng, 2 + tested % 7)
                mu = np.full(len(positions), friction)
                loads = size * balanced_wrenches(rng, positions, normals, mu, limits, 6)
                forces = contact_forces(positions, normals, mu, loads, normal_force=limits)
                program = pyramid_program(positions, normals, mu, limits)
                for load, answer in zip(loads, forces, strict=True):
                    assert kkt_residual(program, load, answer) < 1e-7
                    tested += 1
    assert tested == 6 * 7 * 6


def test_without_the_nearest_points_proxqp_finds_the_same_forces(monkeypatch):
    cases = list(batches(10, 3))
    nearest = [contact_forces(*case[:3], case[4], normal_force=case[3]) for case in cases]
    monkeypatch.setattr(
        forces_module, "least_distance", lambda C, D: np.full((len(D), C.shape[1]), np.nan)
    )
    solved = count_calls(monkeypatch, forces_module, "_solve")
    for case, expected in zip(cases, nearest, strict=True):
        forces = contact_forces(*case[:3], case[4], normal_force=case[3])
        np.testing.assert_allclose(forces, expected, atol=1e-5 * np.abs(expected).max())
    assert len(solved) == 10 * 8


@pytest.mark.parametrize("objective", ["least_norm", "least_friction"])
def test_one_friction_each_is_respected_and_alike_is_the_same_as_one_for_all(objective):
    rng = np.random.default_rng(6)
    tested = 0
    for slippery in (0.0, 0.05, 0.2) * 4:
        positions, normals = random_contacts(rng, 5)
        friction = np.array([slippery, 0.3, 0.5, 0.8, 1.2])
        loads = balanced_wrenches(rng, positions, normals, friction, LIMITS, 3)
        options = {"objective": objective, "normal_force": LIMITS}
        forces = contact_forces(positions, normals, friction, loads, **options)
        for load, answer in zip(loads, forces, strict=True):
            along, across = normal_and_tangential(answer, normals)
            assert (across <= friction * along + SLACK).all()
            assert np.abs(grasp_map(positions) @ answer.ravel() + load).max() < SLACK
            tested += 1
        alike = contact_forces(positions, normals, np.full(5, 1.2), loads, **options)
        one = contact_forces(positions, normals, 1.2, loads, **options)
        np.testing.assert_array_equal(alike, one)
    assert tested == 36


def test_least_friction_uses_the_least_share_of_frictions_that_differ():
    """The least share, by bisection on exact cones; the forces then need no more of any contact."""
    rng = np.random.default_rng(7)
    tested = 0
    for trial in range(12):
        positions, normals = random_contacts(rng, 4 + trial % 3)
        friction = rng.uniform(0.2, 1.0, len(positions))
        friction[0] *= trial % 2
        load = balanced_wrenches(rng, positions, normals, friction, (0.0, 10.0), 1)[0]
        lower, upper = 0.0, 1.0
        for _ in range(20):
            middle = 0.5 * (lower + upper)
            limit = WrenchBody(positions, normals, middle * friction, 10.0).limit(load)
            lower, upper = (lower, middle) if limit.limit >= 1.0 else (middle, upper)
        forces = contact_forces(
            positions, normals, friction, load, objective="least_friction", normal_force=(0.0, 10.0)
        )
        along, across = normal_and_tangential(forces, normals)
        pressed = across > SLACK
        share = (across[pressed] / (friction * along)[pressed]).max(initial=0.0)
        assert lower * (1 - 1e-3) <= share <= upper * (1 + 5e-3) + 1e-5
        tested += 1
    assert tested == 12


def test_the_first_wrench_without_forces_is_named():
    loads = np.zeros((6, 6))
    loads[3, 0], loads[5, 0] = 100.0, 200.0
    for objective in ("least_norm", "least_friction"):
        options = {"objective": objective, "normal_force": (0.0, 10.0)}
        with pytest.raises(NoForcesError, match="balance wrench 3, counting from 0; lower"):
            contact_forces(TETRA_CENTERS, TETRA_NORMALS, 0.5, loads, **options)
        with pytest.raises(NoForcesError, match=r"friction 0.5 and .* balance this wrench; lower"):
            contact_forces(TETRA_CENTERS, TETRA_NORMALS, 0.5, loads[3], **options)
        with pytest.raises(NoForcesError, match=r"friction \[0.5 0.5 0.5 0.4\]"):
            contact_forces(TETRA_CENTERS, TETRA_NORMALS, [0.5, 0.5, 0.5, 0.4], loads[3], **options)


@pytest.mark.parametrize("objective", ["least_norm", "least_friction"])
def test_no_wrench_needs_no_forces_and_next_to_none_a_mere_squeeze(objective):
    loose = contact_forces(TETRA_CENTERS, TETRA_NORMALS, 0.5, np.zeros(6), objective=objective)
    np.testing.assert_allclose(loose, np.zeros((4, 3)), atol=1e-9)
    loads = np.vstack([np.zeros(6), 1e-12 * np.eye(6)])
    squeezed = contact_forces(
        TETRA_CENTERS, TETRA_NORMALS, 0.5, loads,
        objective=objective, normal_force=(0.5, math.inf),
    )  # fmt: skip
    for forces in squeezed:
        along, across = normal_and_tangential(forces, TETRA_NORMALS)
        assert (along >= 0.5 - SLACK).all()
        assert across.max() < 1e-6
        if objective == "least_norm":
            np.testing.assert_allclose(along, 0.5, rtol=1e-6)


def test_no_wrenches_get_no_forces():
    assert contact_forces(TETRA_CENTERS, TETRA_NORMALS, 0.5, np.empty((0, 6))).shape == (0, 4, 3)


@pytest.mark.parametrize(
    "wrench", [1.0, np.ones(5), np.ones((2, 5)), np.ones((1, 2, 6)), [[1.0], [1.0, 2.0]], "push",
               np.full(6, np.nan), np.full((3, 6), np.inf)],
)  # fmt: skip
def test_wrenches_of_other_shapes_are_refused(wrench):
    with pytest.raises(gc.InputError, match="wrench must"):
        contact_forces(TETRA_CENTERS, TETRA_NORMALS, 0.5, wrench)


@pytest.mark.parametrize(
    "friction", [np.full(3, 0.5), np.full((4, 1), 0.5), -0.1, [0.5] * 3 + [-1]]
)
def test_bad_frictions_are_refused(friction):
    with pytest.raises(gc.InputError, match="friction must"):
        contact_forces(TETRA_CENTERS, TETRA_NORMALS, friction, np.ones(6))


def test_an_unknown_objective_is_refused():
    with pytest.raises(gc.InputError, match="objective must be one of least_norm, least_friction"):
        contact_forces(TETRA_CENTERS, TETRA_NORMALS, 0.5, np.ones(6), objective="least_norms")


def test_loads_far_below_the_limit_are_balanced_all_the_same():
    """A hundred-millionth of the limit: to no fewer digits than a large load."""
    rng = np.random.default_rng(31)
    wrenches = 1e-7 * rng.normal(size=(20, 6))
    forces = gc.contact_forces(
        TETRA_CENTERS, TETRA_NORMALS, 0.5, wrenches, normal_force=(0.0, 10.0)
    )
    total = forces.reshape(20, -1) @ grasp_map(TETRA_CENTERS).T + wrenches
    assert np.abs(total).max() < 1e-13
    pair = np.array([[1.0, 0, 0], [-1, 0, 0]])
    with pytest.raises(gc.NoForcesError):
        gc.contact_forces(pair, -pair, 0.5, [0, 0, 0, 9e-6, 0, 0], normal_force=(0.0, 10.0))
    with pytest.raises(gc.NoForcesError):
        gc.contact_forces(TETRA_CENTERS, TETRA_NORMALS, 0.0, [0, 0, 0, 9e-6, 0, 0])


def closed_just_so(rng):
    """Random contacts with a friction above the critical one by 0.5 % to twice, and a wrench."""
    while True:
        count = int(rng.choice((3, 4, 5, 6), p=(0.1, 0.7, 0.1, 0.1)))
        positions, normals = random_contacts(rng, count, spread=rng.uniform(0.3, 1.5))
        critical = gc.critical_friction(positions, normals)
        if 1e-3 < critical < 5.0:
            above = 0.005 if rng.uniform() < 0.3 else 10.0 ** rng.uniform(-2.3, 0.0)
            wrench = 10.0 ** rng.uniform(-2.0, 2.0) * rng.normal(size=6)
            return positions, normals, (1.0 + above) * critical, wrench


def check_closed_contacts(objective, count, seed):
    """Every wrench gets forces that balance it within the cones."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        positions, normals, friction, wrench = closed_just_so(rng)
        forces = contact_forces(positions, normals, friction, wrench, objective=objective)
        along, across = normal_and_tangential(forces, normals)
        assert (across <= (1.0 + 1e-6) * friction * along + 1e-6 * np.abs(forces).max()).all()
        off = np.abs(grasp_map(positions) @ forces.ravel() + wrench).max()
        assert off <= 1e-6 * np.abs(wrench).max()


@pytest.mark.parametrize("objective", ["least_norm", "least_friction"])
def test_contacts_in_closure_balance_every_wrench(objective):
    """Just above the critical friction too, where pyramids in the cones hold no forces."""
    check_closed_contacts(objective, 60, seed=40)


@pytest.mark.long
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("objective", ["least_norm", "least_friction"])
def test_two_thousand_sets_of_contacts_in_closure_balance_every_wrench(objective):
    check_closed_contacts(objective, 2_000, seed=41)


def test_forces_in_exact_cones_are_no_larger_than_those_in_pyramids():
    """And no smaller by more than pyramids with as much more friction save."""
    rng, tested = np.random.default_rng(42), 0
    for trial in range(30):
        positions, normals, friction, wrench = closed_just_so(rng)
        each = np.full(len(normals), 1.5 * friction)
        each[0] *= trial % 3 > 0
        limits = (0.0, math.inf) if trial % 2 else (0.0, 50.0 * np.abs(wrench).max())
        try:
            outer = contact_forces(
                positions, normals, each / INSCRIBED, wrench, normal_force=limits
            )
            inner = contact_forces(positions, normals, each, wrench, normal_force=limits)
        except NoForcesError:  # a frictionless contact, or limits
            continue
        balance = Balance.of(positions, normals, wrench[None], limits, by_load=True)
        exact = balance.in_space(least_norm_in_cones(balance, each)[None])[0]
        sizes = [np.linalg.norm(forces) for forces in (outer, exact, inner)]
        assert sizes[0] * (1.0 - 1e-6) <= sizes[1] <= sizes[2] * (1.0 + 1e-6)
        tested += 1
    assert tested >= 15


def test_limits_are_no_remedy_where_there_are_none():
    pair = np.array([[1.0, 0, 0], [-1, 0, 0]])
    with pytest.raises(NoForcesError, match="use more friction or move the contacts"):
        contact_forces(pair, -pair, 0.5, [0, 0, 0, 1.0, 0, 0])


@pytest.mark.timeout(60)
@pytest.mark.parametrize("objective", ["least_norm", "least_friction"])
@pytest.mark.parametrize("part", [0, 5])
def test_loads_far_beyond_the_limits_are_refused_without_a_search(objective, part):
    """A solver was busy for seven seconds with each of these."""
    loads = np.zeros((20, 6))
    loads[:, part] = 1.0
    with pytest.raises(gc.NoForcesError, match="wrench 0, counting from 0"):
        gc.contact_forces(
            TETRA_CENTERS, TETRA_NORMALS, 0.5, loads, normal_force=(0.0, 1e-9), objective=objective
        )
