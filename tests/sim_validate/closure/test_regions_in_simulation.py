"""Contacts anywhere in certified regions hold in simulation, and are lost outside, not inside."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_core as gc
import scenes
import sim_validate as sv
from grasp_core.optimizing.better_contacts import pieces_under
from grasp_core.values import Contact
from tests.marks import more

FRICTION, CONES = 0.5, 1_250
SLACK = 1e-7
WALKS = np.concatenate([[0.95, 1.0], np.arange(1.02, 1.2, 0.02), np.arange(1.2, 4.01, 0.1)])
"""How far contacts walk, relative to the border."""
AGENDA = sv.Agenda(controls=False, critical_friction=False)


@pytest.mark.slow
@pytest.mark.parametrize("family", ["regulus", *more("concurrent", "free", "pencil")])
def test_what_the_regions_say_is_so_in_simulation(family):
    tested, far = 0, np.zeros((0, 2))
    for name in ("wedge", "hex-nut", "octahedron", "mug"):
        body = scenes.example_object(name)
        grasps = gc.plan(body, FRICTION, families=(family,), limit=1).grasps
        if not grasps:
            continue
        proved = gc.certify_regions(body, grasps[0], FRICTION, max_cones=CONES)
        assert proved is not None
        assert proved.verify()
        rng = np.random.default_rng(0)
        for _ in range(60):
            assert closed(grasps[0], drawn(proved, rng))
        held = [holds(body, grasps[0], drawn(proved, rng)) for _ in range(20)]
        assert False not in held
        assert held.count(True) >= 15
        far = np.vstack([far, *walks(body, grasps[0], proved, rng)])
        tested += 1
    assert tested >= 2
    assert (far > 1.0).all()
    assert (far[:, 1] >= far[:, 0]).all()  # not lost before closure is
    assert np.isfinite(far).all(axis=1).any()  # some walks end before they leave their faces


def drawn(proved, rng):
    """Contacts in the regions, corners often."""
    polygons = [region.polygon for region in proved.regions]
    return np.array([rng.dirichlet(np.full(len(p), rng.choice([0.02, 0.3, 1.0]))) @ p
                     for p in polygons])  # fmt: skip


def closed(grasp, positions):
    return gc.force_closure(positions, grasp.normals, FRICTION).closed


def holds(body, grasp, positions):
    """Whether contacts hold all wrenches in simulation; None if fingertips find no room."""
    moved = replace(grasp, contacts=tuple(map(Contact, positions, grasp.normals)))
    try:
        verdict = sv.validate(body, moved, FRICTION, agenda=AGENDA)
    except gc.GraspError:
        return False  # no closure, so that no wrenches can be chosen
    return None if verdict.outcome is sv.Outcome.INVALID_START else verdict.held


def walks(body, grasp, proved, rng):
    """How far contacts walk, to random corners and to an open choice."""
    polygons = [region.polygon for region in proved.regions]
    middles = np.array([polygon.mean(axis=0) for polygon in polygons])
    for _ in range(3):
        corners = np.array([polygon[rng.integers(len(polygon))] for polygon in polygons])
        yield walked(body, grasp, middles, corners)
    if proved.open_choice is not None:
        share = proved.radius / proved.limit
        borders = proved.centers + share * (proved.open_choice - proved.centers)
        yield walked(body, grasp, proved.centers, borders)


def walked(body, grasp, middles, borders):
    """How far contacts walk from their middles, the borders at one, till not closed and not held.

    Infinite where a contact leaves its face before that.
    """
    pieces = pieces_under(body, grasp)
    opened = dropped = float("inf")
    for far in WALKS:
        positions = middles + far * (borders - middles)
        at = (positions - body.center_of_mass) / body.radius
        if min(p.inset(x) for p, x in zip(pieces, at, strict=True)) < -SLACK:
            break
        is_closed = closed(grasp, positions)
        if not is_closed:
            opened = min(opened, far)
        if (not is_closed or far <= 1.0) and holds(body, grasp, positions) is False:
            dropped = far
            break
    return opened, dropped
