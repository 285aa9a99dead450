"""Charts show what the analysis and the simulation say."""

import math
from dataclasses import replace

import matplotlib
import numpy as np
import pytest

import grasp_core as gc
from grasp_core.closure.wrench_sets import WrenchSet
from scenes.drawing.canvas import encoded, own_style_and_sheets, write_figure
from scenes.drawing.pictures import grasp_figure
from sim_validate.replaying.recorded import Recorded
from sim_validate.replaying.replay import replayed
from sim_validate.reports.agreement import (
    Agreement,
    as_predicted,
    frictions_in,
    limits_in,
    quadrants_in,
)
from sim_validate.reports.fidelity_charts import fidelity_figure, ticks_between
from sim_validate.reports.margin_charts import directions_of_map, margin_figure, on_map
from sim_validate.reports.motion_charts import friction_used, motion_figure
from sim_validate.reports.wrench_charts import shadow_of, wrench_figure
from sim_validate.simulation.setup import Agenda, Setup
from tests.scenes.drawing.test_pictures import assert_inside
from tests.sim_validate.rigs import grasps

FRICTION = 0.5


@pytest.fixture(scope="module")
def wedge():
    body, (grasp,) = grasps("wedge", FRICTION, 1, ("pencil",), "tilted")
    return body, grasp


@pytest.fixture(scope="module")
def trial(wedge):
    body, grasp = wedge
    return replayed(
        Recorded(grasp.id, body, grasp.contacts, FRICTION, Setup(), Agenda(), grasp=grasp)
    )


def wrench_set(body, grasp):
    return WrenchSet.of(grasp, None, FRICTION, center=body.center_of_mass, torque_scale=body.radius)


def test_a_shadow_holds_all_wrenches_and_is_touched_by_them(wedge):
    """The set by its definition: random forces in the cones, normal parts of sum at most one."""
    wrenches = wrench_set(*wedge)
    rng = np.random.default_rng(0)
    plane = np.linalg.qr(rng.normal(size=(6, 2)))[0].T
    border = shadow_of(wrenches, plane)
    shares = rng.dirichlet(np.full(4, 0.05), 20_000)
    angles = rng.uniform(0.0, 2.0 * np.pi, shares.shape)
    slides = rng.choice([0.5, 1.0], shares.shape)
    sideways = FRICTION * slides * shares
    forces = np.stack([shares, sideways * np.cos(angles), sideways * np.sin(angles)], axis=2)
    points = forces.reshape(len(shares), -1) @ (plane @ wrenches.G).T
    angles = np.linspace(0.0, 2.0 * np.pi, 181)
    ways = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    reach = (border @ ways.T).max(axis=0)
    found = (points @ ways.T).max(axis=0)
    assert (found <= reach + 1e-12).all()
    assert (found >= 0.8 * reach).all()  # the samples are many enough to come near everywhere
    np.testing.assert_allclose(reach, wrenches.supports(ways @ plane), rtol=1e-12)


def test_a_map_covers_equal_areas_equally():
    """Small cells anywhere on the sphere have twice the area that they have on the map."""
    rng = np.random.default_rng(0)
    step = 1e-4
    for longitude, latitude in zip(rng.uniform(-3, 3, 50), rng.uniform(-1.4, 1.4, 50), strict=True):
        corner, east, north = (
            np.array(on_map(*map(np.array, (longitude + a, latitude + b))))
            for a, b in ((0.0, 0.0), (step, 0.0), (0.0, step))
        )
        area = abs(np.linalg.det([east - corner, north - corner]))
        assert area == pytest.approx(0.5 * step**2 * math.cos(latitude), rel=1e-2)


def test_a_map_is_of_unit_vectors_with_x_in_the_middle():
    ways = directions_of_map()
    np.testing.assert_allclose(np.linalg.norm(ways, axis=2), 1.0)
    rows, columns, _ = ways.shape
    np.testing.assert_allclose(ways[rows // 2, columns // 2], [1.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(ways[:, 0], ways[:, -1], atol=1e-12)
    np.testing.assert_allclose(on_map(np.zeros(1), np.zeros(1)), 0.0, atol=1e-12)


def test_the_map_shows_what_is_resisted(wedge):
    body, grasp = wedge
    figure = margin_figure(body, grasp, FRICTION, max_normal_force_n=7.0)
    ways = directions_of_map().reshape(-1, 3)
    rng = np.random.default_rng(0)
    shown = [axes.collections[0].get_array() for axes in figure.axes[::2]]
    for place in rng.integers(len(ways), size=6):
        for kind, lever, unit in ((0, 1.0, 1.0), (3, body.radius, 1e3)):
            wrench = np.zeros(6)
            wrench[kind : kind + 3] = lever * ways[place]
            limit = gc.max_resisted_wrench(
                grasp, None, FRICTION, wrench, max_normal_force=7.0,
                center=body.center_of_mass,
            )  # fmt: skip
            value = np.ravel(shown[kind // 3])[place]
            assert value == pytest.approx(unit * lever * limit, rel=1e-6)


def test_without_closure_there_is_no_map(wedge):
    body, grasp = wedge
    with pytest.raises(gc.InputError, match=r"not in force closure at friction 0\.001"):
        margin_figure(body, grasp, 0.001)
    title = wrench_figure(body, grasp, 0.001).axes[0].get_title()
    assert "not in force closure" in title


def test_pushes_balance_the_wrench(wedge, trial):
    """Newton: at rest, what the fingers push with and the wrench have no sum.

    Levers are known as well as the object stayed: to 2e-4 of the grasp's size.
    """
    body, grasp = wedge
    frames = trial.scene.layout.frames
    forces = np.einsum("kij,nkj->nki", frames, trial.watched.pushes_n)[-1]
    arms = grasp.positions - body.center_of_mass
    wrench = trial.load.wrench
    assert np.linalg.norm(wrench[:3]) > 0.1
    np.testing.assert_allclose(forces.sum(axis=0), -wrench[:3], atol=1e-6)
    torque = np.cross(arms, forces).sum(axis=0)
    lever = 2e-4 * trial.scene.layout.grasp_size_m
    atol = lever * np.linalg.norm(forces, axis=1).sum()
    assert atol < 0.05 * np.linalg.norm(wrench[3:])
    np.testing.assert_allclose(torque, -wrench[3:], rtol=0.0, atol=atol)


def test_friction_is_lowered_at_time_zero(trial):
    watched = trial.watched
    assert len(watched.times_s) == len(watched.friction) == len(watched.pushes_n)
    np.testing.assert_array_equal(watched.friction > FRICTION, watched.times_s <= 0.0)
    assert watched.times_s[-1] == pytest.approx(trial.watched.trace.times_s[-1])


def test_friction_used_is_one_where_a_finger_slips():
    pushes = np.array([[[2.0, 0.6, 0.8], [2.0, 0.0, 0.5], [0.0, 0.0, 0.0]]])
    np.testing.assert_allclose(friction_used(pushes, np.array([0.5])), [[1.0, 0.5, np.nan]])


def verdict(trials, controls=(), frictions=(0.1, 0.1)):
    return {
        "critical_friction": dict(zip(("predicted", "simulated"), frictions, strict=True)),
        "settings": {"grasp_size_m": 0.5},
        "wrenches": [
            {"predicted_limit": limit, "outcome": outcome, "simulated_limit": simulated,
             "wrench": [0.0, 3.0, 0.0, 2.0, 0.0, 0.0]}
            for limit, outcome, simulated in trials
        ],
        "controls": {
            str(place): {"wrenches": [{"outcome": outcome}]}
            for place, outcome in enumerate(controls)
        },
    }  # fmt: skip


def test_trials_are_counted_by_what_was_predicted_and_what_happened():
    counted = quadrants_in([
        verdict([(1.25, "held", None), (1.1, "slipped", None), (0.9, "held", None),
                 (1.01, "slipped", None), (0.99, "held", None)], ["slipped"]),
        verdict([(0.5, "lost_contact", None), (None, "slipped", None)], ["held", "diverged"]),
    ])  # fmt: skip
    assert counted.resisted_held == 1
    assert counted.resisted_let_go == 1
    assert counted.not_resisted_held == 2
    assert counted.not_resisted_let_go == 3
    assert counted.neither == 3  # two are too near their limits, as for `validate`


def test_trials_end_as_predicted_or_as_they_might():
    cases = [(1.25, "held", True), (1.25, "slipped", False), (1.25, "timeout", False),
             (0.5, "slipped", True), (0.5, "held", False), (None, "lost_contact", True),
             (1.01, "slipped", True), (0.99, "held", True), (0.99, "diverged", False)]  # fmt: skip
    for limit, outcome, right in cases:
        assert as_predicted({"predicted_limit": limit, "outcome": outcome}) is right


def test_pairs_are_of_what_was_measured():
    listed = [verdict([(2.0, "held", 2.1), (1.5, "held", None)]), verdict([], (), (0.2, None)),
              verdict([], (), (7e-4, 0.0))]  # fmt: skip
    assert frictions_in(listed).pairs == ((0.1, 0.1),)
    assert frictions_in(listed).below == 1
    (pair,) = limits_in(listed).pairs
    assert pair == pytest.approx((10.0, 10.5))  # 5 N: 3 N and 2 N m over half a metre
    assert limits_in(listed).worst == pytest.approx(0.05)


def test_ticks_are_round_numbers_in_the_range():
    assert ticks_between(0.9, 12.0) == [1.0, 2.0, 5.0, 10.0]
    assert ticks_between(0.011, 90.0) == pytest.approx([0.1, 1.0, 10.0])


@pytest.mark.parametrize("unit", [1.0, 1e-4])
def test_what_differs_stands_out(unit):
    pairs = ((unit, 1.01 * unit), (unit, 1.5 * unit), (0.0, 0.3 * unit))
    agreements = [Agreement("a", pairs), Agreement("b", ())]
    assert agreements[0].worst == math.inf
    assert agreements[0].differ() == (False, True, True)
    (one, two) = fidelity_figure(agreements).axes
    labels = [text.get_text() for text in one.get_legend().get_texts()]
    assert {"identity", "1 agree", "2 differ"} <= set(labels)
    assert two.get_title() == "b"
    assert [text.get_text() for text in two.texts] == ["none measured"]
    assert not two.lines


def test_a_trial_that_blew_up_is_drawn(trial):
    trace = trial.watched.trace
    moved = np.where(np.arange(len(trace.times_s)) < 5, trace.displacements_m, np.inf)
    for values in (moved, np.full_like(moved, np.nan)):
        blown = replace(trace, displacements_m=values)
        watched = replace(trial.watched, trace=blown)
        figure = motion_figure(replace(trial, watched=watched), 1e-5)
        assert len(encoded(figure, "png")) > 5000


def test_figures_do_not_depend_on_what_users_have_set(wedge):
    plain = encoded(wrench_figure(*wedge, FRICTION), "svg")
    with matplotlib.rc_context({"lines.linewidth": 6.0, "font.size": 20.0, "axes.grid": True}):
        assert encoded(wrench_figure(*wedge, FRICTION), "svg") == plain


def test_the_scale_of_a_map_ends_at_its_least_and_largest_value(wedge):
    figure = margin_figure(*wedge, FRICTION)
    for drawn, scale in zip(figure.axes[::2], figure.axes[1::2], strict=True):
        values = drawn.collections[0].get_array()
        assert scale.get_ylim() == (values.min(), values.max())
        np.testing.assert_array_equal(np.unique(scale.collections[0].get_array()), scale.get_ylim())


def test_a_figure_that_is_used_again_is_drawn_as_a_new_one(wedge, trial, tmp_path):
    """Others before it leave nothing behind: no line, text, range or scale."""
    body, grasp = wedge
    other = replace(grasp, contacts=grasp.contacts[::-1], faces=grasp.faces[::-1])
    makers = {
        "picture": lambda each, mu: grasp_figure(body, each, mu, legend=False),
        "wrenches": lambda each, mu: wrench_figure(body, each, mu),
        "margins": lambda each, mu: margin_figure(body, each, mu),
        "motion": lambda _, mu: motion_figure(trial, mu * 1e-5),
    }
    for name, make in makers.items():
        expected = encoded(make(grasp, FRICTION), "png")
        with own_style_and_sheets():
            first = make(other, 0.9)
            write_figure(first, tmp_path / "first.png")
            again = make(grasp, FRICTION)
            assert again is first, name
            assert make(grasp, FRICTION) is not again
            write_figure(again, tmp_path / "again.png")
        assert (tmp_path / "again.png").read_bytes() == expected, name
        assert (tmp_path / "first.png").read_bytes() != expected, name
        assert make(grasp, FRICTION) is not again


@pytest.mark.parametrize("kind", ["wrenches", "margins", "motion", "fidelity", "one panel"])
def test_labels_of_charts_are_whole(kind, wedge, trial):
    figure = {
        "wrenches": lambda: wrench_figure(*wedge, FRICTION),
        "margins": lambda: margin_figure(*wedge, FRICTION),
        "motion": lambda: motion_figure(trial, 1e-5),
        "fidelity": lambda: fidelity_figure(
            [Agreement("critical friction", ((0.013, 0.013), (0.4, 0.41))),
             Agreement("largest wrench [N], torques over grasp size", ((3.0, 3.1),))]
        ),
        "one panel": lambda: fidelity_figure([Agreement("critical friction", ((0.1, 0.1),))]),
    }[kind]()  # fmt: skip
    encoded(figure, "png")
    assert_inside(figure)
