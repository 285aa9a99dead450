"""Slow: a thousand grasps of each family, and two hundred with all of their regions."""

import math
from collections import Counter
from itertools import product
from pathlib import Path

import numpy as np
import pytest

import grasp_core as gc
from scenes.example_objects import example_names, example_object
from tests.marks import MORE, more

THETA = math.radians(10.0)
FRICTION = math.tan(THETA)
BORDER = 1e-6
"""Friction above that of the force cones: contacts on the borders use their very edge."""
PIECES = Path(__file__).parents[4] / "shared" / "objects" / "ycb" / "pieces"
RANDOM = [f"random-{faces}-{seed}" for faces in (12, 16, 20, 24, 28, 32) for seed in range(1, 6)]
FACES_AT_MOST = 34


def bodies():
    """Built-in objects, random polyhedra and, where present, real pieces."""
    names = [name for name in example_names() if "FACES" not in name]
    yield from (example_object(name) for name in names + RANDOM)
    yield from (gc.load_polyhedron(path) for path in sorted(PIECES.glob("*.obj")))


@pytest.mark.slow
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("least", [200, *more(1000)])
def test_many_grasps_of_each_family_are_closed_and_are_what_they_claim(least):
    found, rejected = Counter(), 0
    for body in bodies():
        if len(body.faces) > FACES_AT_MOST:
            continue
        wanted = [f for f in ("concurrent", "pencil", "regulus") if found[f] < least]
        if not wanted:
            break
        plan = gc.plan(body, FRICTION, families=wanted, cones="normal")
        rejected += sum(counts.rejected for counts in plan.counts.families.values())
        for grasp in plan.grasps:
            x, n, f = grasp.witness.points, grasp.normals, grasp.witness.forces
            assert grasp.family == gc.classify_lines(x, f)
            assert gc.force_closure(grasp, friction=FRICTION).verify()
            along = np.einsum("ki,ki->k", f, n)
            across = np.linalg.norm(f - along[:, None] * n, axis=1)
            assert (across <= FRICTION * along).all()
            assert np.abs(f.sum(axis=0)).max() < 1e-8
            assert np.abs(np.cross(x, f).sum(axis=0)).max() < 1e-8 * body.radius
            found[grasp.family] += 1
    assert rejected == 0
    assert min(found.values()) >= least, found


@pytest.mark.slow
@pytest.mark.timeout(1200)
@pytest.mark.parametrize(
    ("family", "count"),
    [("pencil", 40), *(pytest.param(each, 200, marks=MORE) for each in ("pencil", "concurrent"))],
)
def test_no_contacts_in_the_regions_of_many_grasps_lose_closure(family, count):
    """A hundred choices each, corners and extremes first, then descent over the borders."""
    rng = np.random.default_rng(7)
    grasps = points = 0
    for name in ("random-20-7", "icosahedron", "random-24-2", "random-16-1", "dodecahedron"):
        body = example_object(name)
        planned = gc.plan(body, FRICTION, families=(family,), limit=240, cones="normal").grasps
        # with narrow cones, margins on the borders come near what the closure test can decide
        wide = [grasp for grasp in planned if grasp.force_cones[0].half_angle > 0.5 * THETA]
        for grasp in wide[:: max(1, 5 * len(wide) // (count + 20))]:
            borders = [region.polygon for region in grasp.regions]
            places = list(choices(rng))
            margins = [margin(grasp, borders, place) for place in places]
            assert min(margins) > 0.0, grasp.id
            start = places[int(np.argmin(margins[:CORNERS]))]
            assert descend(grasp, borders, start[0]) > 0.0, grasp.id
            grasps, points = grasps + 1, points + len(places)
    assert grasps >= count
    assert points >= 100 * grasps


CORNERS = 60


def choices(rng):
    """Where along the four borders, as shares of their corners, and how far from the middle."""
    quarters = list(product((0.0, 0.5), repeat=4)) + list(product((0.25, 0.75), repeat=4))
    for turns in quarters:
        yield np.array(turns), np.ones(4)
    for _ in range(CORNERS - len(quarters)):
        yield rng.uniform(size=4), np.ones(4)
    for _ in range(100 - CORNERS):
        yield rng.uniform(size=4), rng.uniform(size=4) ** 0.5


def margin(grasp, borders, choice):
    points = []
    for polygon, turn, share in zip(borders, *choice, strict=True):
        at = turn * len(polygon)
        here, after = int(at) % len(polygon), (int(at) + 1) % len(polygon)
        edge = polygon[here] + (at - int(at)) * (polygon[after] - polygon[here])
        middle = polygon.mean(axis=0)
        points.append(middle + share * (edge - middle))
    friction = math.tan(max(cone.half_angle for cone in grasp.force_cones)) + BORDER
    return gc.force_closure(points, grasp.normals, friction).margin


def descend(grasp, borders, turns):
    """Coordinate descent of the closure margin over the places on the four borders."""
    best, step = margin(grasp, borders, (turns, np.ones(4))), 0.15
    while step > 0.01:
        moves = [turns + sign * step * np.eye(4)[k] for k in range(4) for sign in (1.0, -1.0)]
        tried = [margin(grasp, borders, (move % 1.0, np.ones(4))) for move in moves]
        if min(tried) < best:
            best, turns = min(tried), moves[int(np.argmin(tried))] % 1.0
        else:
            step *= 0.5
    return best
