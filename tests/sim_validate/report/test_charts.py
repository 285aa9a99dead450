"""Charts show what the analysis and the simulation say."""

import math
from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
import sim_validate as sv
from grasp_core.closure.wrench_sets import WrenchSet
from scenes.drawing.panels import thinned
from scenes.drawing.pictures import Drawing
from scenes.drawing.sheets import BAD_HEX, GOOD_HEX, LEVELS, Area, Dots, Image, png_of, svg_of
from sim_validate.closure.controls import ControlTrial
from sim_validate.closure.replaying import Recorded, replayed
from sim_validate.closure.verdict import WrenchVerdict
from sim_validate.engine.held_or_let_go import HoldVerdict, Outcome
from sim_validate.engine.setup import Agenda, Setup
from sim_validate.engine.simulated_friction import CriticalFriction
from sim_validate.engine.simulated_limits import SimulatedLimit
from sim_validate.report.charts import (
    Agreement,
    as_predicted,
    directions_of_map,
    fidelity_panel,
    friction_used,
    frictions_in,
    limits_in,
    margin_figure,
    margin_panels,
    margins,
    motion_panels,
    on_map,
    pixels,
    quadrants_in,
    shadow_of,
    wrench_panels,
)
from tests.scenes.drawing.whole import assert_whole
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


def test_a_shadow_holds_all_wrenches_and_is_touched_by_them(wedge):
    """The set by its definition: random forces in the cones, normal parts of sum at most one."""
    body, grasp = wedge
    about = {"center": body.center_of_mass, "torque_scale": body.radius}
    wrenches = WrenchSet.of(grasp, None, FRICTION, **about)
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


def shares_of_limits(body, grasp, friction):
    """Every node of both maps over the limit that a program finds there."""
    shown = margins(Drawing(body, grasp, friction), 7.0)
    ways = directions_of_map().reshape(-1, 3)
    still = np.zeros_like(ways)
    wrenches = np.vstack([np.hstack([ways, still]), np.hstack([still, body.radius * ways])])
    found = gc.wrench_limits(
        grasp, None, friction, wrenches, max_normal_force=7.0, center=body.center_of_mass
    )
    units = np.repeat([1.0, 1e3 * body.radius], len(ways))
    return np.ravel(shown) / (units * [each.limit for each in found])


@pytest.mark.parametrize("above", [FRICTION, 1e-2, 1e-4])
@pytest.mark.parametrize(
    ("name", "family"),
    [("wedge", "concurrent"), ("wedge", "pencil"), ("dodecahedron", "regulus")],
)
def test_the_map_shows_what_is_resisted(name, family, above):
    """Far above the critical friction, and hardly above it."""
    body, (grasp,) = grasps(name, FRICTION, 1, (family,), "tilted")
    friction = grasp.critical_friction + above
    np.testing.assert_allclose(shares_of_limits(body, grasp, friction), 1.0, rtol=2e-3)


def test_where_bounds_do_not_meet_the_map_asks_the_program(wedge, monkeypatch):
    monkeypatch.setattr("grasp_core.quality.limit_bounds.MOST_STEPS", 1)
    np.testing.assert_allclose(shares_of_limits(*wedge, FRICTION), 1.0, rtol=1e-6)


def test_without_closure_there_is_no_map(wedge):
    body, grasp = wedge
    with pytest.raises(gc.InputError, match=r"not in force closure at friction 0\.001"):
        margin_figure(body, grasp, 0.001)
    titles = [words.text for words in wrench_panels(Drawing(body, grasp, 0.001))[0].words()]
    assert any("not in force closure" in title for title in titles)


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


def test_friction_used_is_one_where_a_finger_slips():
    pushes = np.array([[[2.0, 0.6, 0.8], [2.0, 0.0, 0.5], [0.0, 0.0, 0.0]]])
    np.testing.assert_allclose(friction_used(pushes, np.array([0.5])), [[1.0, 0.5, np.nan]])


def hold(outcome):
    return HoldVerdict(Outcome(outcome), "", 0.0, 0.0, 0.0, (), None)


def tried(limit, outcome, simulated=None):
    at = None if simulated is None else SimulatedLimit(0.0, 2.0, simulated / limit)
    return WrenchVerdict("a", (0.0, 3.0, 0.0, 2.0, 0.0, 0.0), limit, 0.1, hold(outcome), at)


def verdict(known, trials, controls=(), frictions=(0.1, 0.1)):
    return replace(
        known,
        critical_friction=CriticalFriction(*frictions),
        scale=replace(known.scale, grasp_size_m=0.5),
        wrenches=tuple(tried(*trial) for trial in trials),
        controls=tuple(
            replace(known.controls[0], tried=(ControlTrial("a", np.ones(6), None, hold(outcome)),))
            for outcome in controls
        ),
    )


@pytest.fixture(scope="module")
def known(wedge):
    return sv.validate(*wedge, FRICTION)


def test_trials_are_counted_by_what_was_predicted_and_what_happened(known):
    counted = quadrants_in([
        verdict(known, [(1.25, "held", None), (1.1, "slipped", None), (0.9, "held", None),
                 (1.01, "slipped", None), (0.99, "held", None)], ["slipped"]),
        verdict(known, [(0.5, "lost_contact", None), (0.0, "slipped", None)], ["held", "diverged"]),
    ])  # fmt: skip
    assert counted == {
        "resisted_held": 1, "resisted_let_go": 1, "not_resisted_held": 2, "not_resisted_let_go": 3,
        "neither": 3,  # two are too near their limits, as for `validate`
    }  # fmt: skip


def test_trials_end_as_predicted_or_as_they_might():
    cases = [(1.25, "held", True), (1.25, "slipped", False), (1.25, "timeout", False),
             (0.5, "slipped", True), (0.5, "held", False), (0.0, "lost_contact", True),
             (1.01, "slipped", True), (0.99, "held", True), (0.99, "diverged", False)]  # fmt: skip
    for limit, outcome, right in cases:
        assert as_predicted(tried(limit, outcome)) is right


def test_pairs_are_of_what_was_measured(known):
    listed = [verdict(known, [(2.0, "held", 2.1), (1.5, "held", None)]),
              verdict(known, [], (), (0.2, None)), verdict(known, [], (), (7e-4, 0.0))]  # fmt: skip
    assert frictions_in(listed).pairs == ((0.1, 0.1),)
    assert frictions_in(listed).below == 1
    (pair,) = limits_in(listed).pairs
    assert pair == pytest.approx((10.0, 10.5))  # 5 N: 3 N and 2 N m over half a metre
    assert limits_in(listed).worst == pytest.approx(0.05)


@pytest.mark.parametrize("unit", [1.0, 1e-4])
def test_what_differs_stands_out(unit):
    pairs = ((unit, 1.01 * unit), (unit, 1.5 * unit), (0.0, 0.3 * unit))
    agreements = [Agreement("a", pairs), Agreement("b", ())]
    assert agreements[0].worst == math.inf
    assert agreements[0].differ() == (False, True, True)
    one, two = map(fidelity_panel, agreements)
    assert {"identity", "1 agree", "2 differ"} <= {words.text for words in one.words()}
    assert {mark.colour for mark in one.marks if isinstance(mark, Dots)} == {GOOD_HEX}
    assert [mark.fill for mark in one.marks if isinstance(mark, Area)].count(
        BAD_HEX
    ) == 3  # one in the key
    assert {"b", "none measured"} <= {words.text for words in two.words()}
    assert not [mark for mark in two.marks if isinstance(mark, Dots)]


def test_a_trial_that_blew_up_is_drawn(trial):
    trace = trial.watched.trace
    moved = np.where(np.arange(len(trace.times_s)) < 5, trace.displacements_m, np.inf)
    for values in (moved, np.full_like(moved, np.nan)):
        blown = replace(trace, displacements_m=values)
        watched = replace(trial.watched, trace=blown)
        sheets = motion_panels(replace(trial, watched=watched), 1e-5)
        for sheet in sheets:
            assert_whole(sheet)
            assert "nan" not in svg_of(sheet)
            assert len(png_of(sheet)) > 2000


def test_the_scale_of_a_map_ends_at_its_least_and_largest_value(wedge):
    drawing = Drawing(*wedge, FRICTION)
    for sheet, values in zip(margin_panels(drawing, 10.0), margins(drawing, 10.0), strict=True):
        said = [words.text for words in sheet.words()]
        assert {f"{values.min():.3g}", f"{values.max():.3g}", f"least: {values.min():.3g}"} <= {
            *said
        }
        drawn, scale = (mark.levels for mark in sheet.marks if isinstance(mark, Image))
        np.testing.assert_array_equal(scale, [range(LEVELS)])
        inside = drawn[drawn >= 0]
        # an ellipse fills pi / 4 of its box; pixels on its border count by their middles
        assert inside.size / drawn.size == pytest.approx(math.pi / 4.0, abs=0.01)
        assert inside.min() <= 1
        assert inside.max() >= LEVELS - 2


def test_the_pixels_of_a_map_are_where_its_directions_are():
    """A linear function of the direction is interpolated to the square of half a cell."""
    ways = directions_of_map()
    way = np.array([0.48, 0.6, 0.64])
    drawn = pixels(ways @ way, -1.0, 1.0)
    rows, columns = drawn.shape
    rng = np.random.default_rng(0)
    for longitude, latitude in zip(rng.uniform(-3, 3, 50), rng.uniform(-1.4, 1.4, 50), strict=True):
        x, y = on_map(np.array(longitude), np.array(latitude))
        flat = math.cos(latitude)
        value = way @ [flat * math.cos(longitude), flat * math.sin(longitude), math.sin(latitude)]
        level = drawn[int(0.5 * (1.0 - y) * rows), int(0.25 * (x + 2.0) * columns)]
        cell = math.pi / 10.0
        slack = 0.5 * cell**2 / 4.0 + 2.0 * 4.0 / rows  # the curve, and two pixels
        assert -1.0 + 2.0 * (level + 0.5) / LEVELS == pytest.approx(value, abs=slack)


@pytest.mark.parametrize("pairs", [((0.013, 0.013), (0.4, 0.41)), ((1e-4, 1e-4), (0.5, 0.7))])
def test_labels_of_fidelity_are_whole(pairs):
    assert_whole(fidelity_panel(Agreement("largest wrench [N], torques over grasp size", pairs)))


def test_a_thinned_curve_misses_no_point_by_a_fifth_of_a_pixel():
    x = np.linspace(0.0, 300.0, 500)
    curve = np.stack([x, 60.0 * np.sin(x / 20.0)], axis=1)
    kept = thinned(curve)
    assert 20 < len(kept) < 150
    drawn = np.interp(x, *kept.T)
    assert np.abs(drawn - curve[:, 1]).max() < 0.2 * math.hypot(1.0, 3.0)  # across, by its slope
    straight = np.stack([x, 2.0 * x], axis=1)
    np.testing.assert_array_equal(thinned(straight), straight[[0, -1]])
