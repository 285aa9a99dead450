"""The pencil and regulus programs as the paper prints them, and the contacts that refute them.

Both read simpler than the constructions in `grasp_core`. The printed pencil program lets the
foci pass each other, so its discs hold contacts out of equilibrium; the printed regulus program
lacks the pitch equation, so its lines are independent. These tests keep anyone from simplifying
the constructions back.
"""

import math
from itertools import product

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.closure.lines import plucker_vectors
from grasp_core.families.placements import LEAST_RADIUS
from grasp_core.families.placing import CONSTRUCTIONS
from grasp_core.families.regulus_kernel import LEAST_DEPTH
from tests.grasp_core.families.disc_borders import BORDER, descended_margin
from tests.grasp_core.families.printed_paper import (
    PAIR,
    Discs,
    focus_gap,
    printed_pencil,
    printed_regulus,
    unit,
)
from tests.grasp_core.quadruples import paired_quadruples
from tests.grasp_core.regular_solids import TOLERANCE
from tests.judges import balancing_weights


def push(normals):
    """w: what pair 1 contributes to a combination of the normals that vanishes."""
    return balancing_weights(normals)[:2] @ normals[:2]


def in_a_safe_cell(quad, discs):
    """Whether the foci are in one of the two orders that have a proof."""
    gap = focus_gap(quad, discs.foci)
    u = unit(push(np.array([piece.normal for piece in quad])))
    reach = [
        p.normal @ (discs.foci[i] - p.origin) * (p.normal @ u) * (1.0 - 2.0 * i)
        - r * np.linalg.norm(p.frame.T @ u)
        for i, p, r in zip(PAIR, quad, discs.radii, strict=True)
    ]
    return gap >= -TOLERANCE or -gap <= min(reach) + TOLERANCE


COUNTEREXAMPLE_THETA = math.radians(5.0)
COUNTEREXAMPLE_RADIUS = math.tan(COUNTEREXAMPLE_THETA / 2.0)


def counterexample(order):
    """Four faces at depth 1 below their foci, c_1 = order * c * e_x = -c_2, as large as you like.

    Returns:
        Normals (4, 3), N per face (4, 3), foci (2, 3) and disc centres (4, 3).
    """
    c = s = math.sqrt(0.5)
    y, z = math.cos(math.radians(16.0)), math.sin(math.radians(16.0))
    n = np.array([(c, s, 0.0), (c, -s, 0.0), (-c, s * y, s * z), (-c, -s * y, -s * z)])
    N = np.array([(0.0, 0.0, 1.0)] * 2 + [(0.0, -z, y)] * 2)
    foci = np.array([(order * c, 0.0, 0.0), (-order * c, 0.0, 0.0)])
    return n, N, foci, foci[list(PAIR)] - n


def corner_choices(N, centers):
    """The 16 choices of contacts at a distance r along +-N_i."""
    for signs in product((1.0, -1.0), repeat=4):
        yield centers + COUNTEREXAMPLE_RADIUS * np.array(signs)[:, None] * N


def test_the_counterexample_meets_all_that_the_paper_asks_of_a_pencil():
    """P3; the foci on a line parallel to both pair planes; discs about their projections; and
    a ball of radius R = r about each in the friction cone of every point of its discs.
    """
    r = COUNTEREXAMPLE_RADIUS
    n, N, foci, centers = counterexample(+1.0)
    assert math.degrees(gc.span_angle(n)) == pytest.approx(5.53996, abs=1e-5)
    u = unit(np.cross(N[0], N[2]))
    assert np.abs(np.cross(foci[0] - foci[1], u)).max() < 1e-12
    rng = np.random.default_rng(0)
    steepest = []
    for i, normal, center in zip(PAIR, n, centers, strict=True):
        sphere = rng.normal(size=(2000, 3))
        ball = foci[i] + r * sphere / np.linalg.norm(sphere, axis=1, keepdims=True)
        flat = sphere - np.outer(sphere @ normal, normal)
        # The border point on the far side of the axis sees a point of the ball steepest.
        border = center - r * flat / np.linalg.norm(flat, axis=1, keepdims=True)
        lines = ball - border
        angles = np.arccos(lines @ normal / np.linalg.norm(lines, axis=1))
        steepest.append(angles.max())
    assert max(steepest) <= COUNTEREXAMPLE_THETA + 1e-12
    assert min(steepest) > 0.99 * COUNTEREXAMPLE_THETA


def test_contacts_in_the_discs_of_the_counterexample_cannot_balance():
    """The lines L_i cross the focus line at one abscissa, where they pass at different heights:
    the line that joins the crossings never comes near the foci on either side.
    """
    n, N, foci, centers = counterexample(+1.0)
    friction = math.tan(COUNTEREXAMPLE_THETA)
    choices = [gc.force_closure(each, n, friction) for each in corner_choices(N, centers)]
    verdict = min(choices, key=lambda each: each.margin)
    contacts = verdict.positions
    assert np.abs(contacts[:, 0]).max() < TOLERANCE
    assert foci[0] @ push(n) > 0.0 > foci[1] @ push(n)
    assert not verdict.closed
    assert verdict.verify()
    assert verdict.margin == pytest.approx(-0.0338, abs=1e-4)
    assert gc.critical_friction(contacts, n) == pytest.approx(0.230244, abs=2e-6)
    assert gc.force_closure(centers, n, friction).closed


def test_swapping_the_foci_of_the_counterexample_closes_every_corner_choice():
    friction = math.tan(COUNTEREXAMPLE_THETA)
    lost = {}
    for order in (+1.0, -1.0):
        n, N, _, centers = counterexample(order)
        verdicts = [gc.force_closure(x, n, friction) for x in corner_choices(N, centers)]
        lost[order] = sum(not verdict.closed for verdict in verdicts)
        worst = min(verdict.margin for verdict in verdicts)
    assert lost == {+1.0: 10, -1.0: 0}
    assert worst == pytest.approx(0.01097, abs=1e-5)


@pytest.mark.slow
def test_an_adversary_breaks_printed_pencils_but_no_corrected_one():
    """At the centres of all discs the forces along the normals balance, and nearly all random
    contacts are closed too: only a search over the borders shows what the printed program does.
    """
    theta = math.radians(5.0)
    friction = math.tan(theta) + BORDER
    printed, broken, corrected = 0, 0, 0

    def adversarial_margin(quad, discs):
        return descended_margin(quad, discs.centers, discs.radii, friction, step=0.8, finest=0.1)

    for quad, cones in paired_quadruples("random-16-1", theta, 12):
        discs = printed_pencil(quad, theta)
        if discs is not None and not in_a_safe_cell(quad, discs):
            printed += 1
            broken += adversarial_margin(quad, discs) < -TOLERANCE
        placed = CONSTRUCTIONS["pencil"].place(quad, cones, LEAST_RADIUS)
        if placed is not None:
            discs = Discs(placed.positions, placed.radii, placed.foci)
            assert in_a_safe_cell(quad, discs)
            assert adversarial_margin(quad, discs) > 0.0
            corrected += 1

    assert printed >= 16
    assert broken >= 1
    assert corrected >= 24


def fourth_singular_value(points, directions):
    """Zero for dependent lines; points about their mean and of unit spread, unit directions."""
    lengths = np.linalg.norm(directions, axis=1, keepdims=True)
    arms = points - points.mean(axis=0)
    lines = plucker_vectors(arms / np.linalg.norm(arms, axis=1).max(), directions / lengths)
    return np.linalg.svd(lines, compute_uv=False)[3]


def test_lines_of_the_printed_regulus_program_are_independent_and_often_open():
    """Same quadruples, cones and least depth. The corrected program only adds the equal pitch, by
    fixed slopes, and a least gap, so it cannot come nearer to the centres of the faces.
    """
    theta = math.radians(10.0)
    friction = math.tan(theta)
    printed, independent, unclosed, corrected = 0, 0, 0, 0
    for name in ("random-16-1", "random-20-7", "random-30-1"):
        for quad, cones in paired_quadruples(name, theta, 50):
            normals = [piece.normal for piece in quad]
            loose = printed_regulus(quad, cones, LEAST_DEPTH)
            if loose is None:
                continue
            printed += 1
            independent += fourth_singular_value(loose.positions, loose.forces) > 10 * TOLERANCE
            unclosed += not gc.force_closure(loose.positions, normals, friction).closed
            placed = CONSTRUCTIONS["regulus"].place(quad, cones)
            if placed is not None:
                assert -placed.merit >= loose.offset - TOLERANCE
                assert fourth_singular_value(placed.positions, placed.forces) < TOLERANCE
                assert gc.force_closure(placed.positions, normals, friction).closed
                corrected += 1
    assert printed >= 25
    assert independent >= 0.98 * printed
    assert unclosed >= 0.3 * printed
    assert corrected >= 25
