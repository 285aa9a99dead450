import numpy as np
import pytest

import grasp_core as gc
from grasp_core.objects.standard_order import clear_of_edges
from scenes.example_objects import example_object


def from_edges(point, face):
    """Distance of a point from the borders of a face."""
    least = np.inf
    for loop in (face.polygon, *face.holes):
        along = np.roll(loop, -1, axis=0) - loop
        share = np.einsum("ki,ki->k", point - loop, along) / np.einsum("ki,ki->k", along, along)
        nearest = loop + np.clip(share, 0.0, 1.0)[:, None] * along
        least = min(least, np.linalg.norm(nearest - point, axis=1).min())
    return least


@pytest.mark.parametrize("name", ["l-bracket", "hex-nut", "mug", "wedge"])
def test_pieces_keep_the_margin_from_every_border_and_lose_little_else(name):
    body, rng = example_object(name), np.random.default_rng(0)
    margin = 0.03 * body.radius
    inset, inner, lost = clear_of_edges(body, margin), 0, 0
    for face, after in zip(body.faces, inset.faces, strict=True):
        for piece in after.pieces:
            for point in rng.dirichlet(np.full(len(piece), 0.3), 30) @ piece:
                assert from_edges(point, face) >= margin * (1.0 - 1e-9)
                inner += 1
        for piece in face.pieces:
            for point in rng.dirichlet(np.ones(len(piece)), 20) @ piece:
                if from_edges(point, face) > 1.5 * margin:
                    lost += not any(_holds(part, point, face.normal) for part in after.pieces)
    assert inner >= 200
    assert lost == 0


def _holds(polygon, point, normal):
    edges = np.roll(polygon, -1, axis=0) - polygon
    return (np.cross(edges, point - polygon) @ normal >= -1e-12).all()


def test_planned_contacts_and_regions_keep_the_margin():
    body = example_object("l-bracket")
    margin, tested = 0.05 * body.radius, 0
    plan = gc.plan(body, 0.5, clearance=margin)
    for grasp in plan.grasps:
        for face, contact, region in zip(grasp.faces, grasp.contacts, grasp.regions, strict=True):
            for point in (contact.position, *region.polygon):
                assert from_edges(point, body.faces[face]) >= margin * (1.0 - 1e-6)
                tested += 1
    assert tested >= 500
    assert len(plan.grasps) >= 40


def test_a_margin_wider_than_all_faces_leaves_nothing():
    body = example_object("wedge")
    plan = gc.plan(body, 0.5, clearance=0.9 * body.radius)
    assert not plan.grasps
    assert plan.outcomes.absent == plan.counts.quadruples
    assert "m from their edges" in plan.absence
    structured = gc.plan(
        body, 0.5, clearance=0.9 * body.radius, families="concurrent", cones="normal"
    )
    assert structured.counts.spanning == 15
    assert "15 face quadruples span" in structured.absence
    with pytest.raises(gc.InputError, match="clearance"):
        gc.plan(body, 0.5, clearance=-1.0)
