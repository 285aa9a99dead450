from dataclasses import replace

import pytest

import grasp_core as gc
from grasp_core.optimizing.better_contacts import pieces_under
from grasp_core.planning.grasps_json import grasps_from_json, plan_to_json
from scenes.example_objects import example_object


def checked(grasp, found, friction):
    """Everything a moved grasp must still be; its gain."""
    assert found.before.verify()
    assert found.after.verify()
    assert found.after.lower >= found.before.lower
    certificate = gc.force_closure(found.grasp, friction=friction)
    assert certificate.closed
    assert certificate.verify()
    assert found.grasp.faces == grasp.faces
    assert found.gain == found.after.lower / found.before.lower
    return found.gain


@pytest.mark.parametrize(
    ("name", "limit"),
    [("wedge", 2), pytest.param("double-wedge-bar", 1, marks=pytest.mark.slow)],
)
def test_grasps_get_better_and_stay_certified(name, limit):
    body = example_object(name)
    plan = gc.plan(body, 0.5, limit=limit)
    found = [gc.optimize_contacts(body, grasp, 0.5) for grasp in plan.grasps]
    gains = [checked(g, f, 0.5) for g, f in zip(plan.grasps, found, strict=True)]
    assert min(gains) > 1.01
    saved = grasps_from_json(plan_to_json(body, replace(plan, grasps=[f.grasp for f in found])))
    for grasp, improved in zip(saved.grasps, found, strict=True):
        assert grasp.id.startswith("o-")
        assert grasp.family == "regulus"
        low, high = grasp.ferrari_canny
        assert low == pytest.approx(improved.after.lower, rel=1e-3)
        assert low < high


def test_contacts_keep_a_fingers_radius_from_the_edges():
    body = example_object("wedge")
    (grasp,) = gc.plan(body, 0.5, families="concurrent", limit=1).grasps
    found = gc.optimize_contacts(body, grasp, 0.5, finger_radius=0.02 * body.radius)
    pieces = pieces_under(body, found.grasp)
    points = (found.grasp.positions - body.center_of_mass) / body.radius
    for piece, point, own in zip(pieces, points, grasp.regions, strict=True):
        room = float((piece.b - piece.E @ (piece.frame.T @ (point - piece.origin))).min())
        least = min(0.02, 0.5 * piece.inradius, own.inscribed_radius / body.radius)
        assert room >= least - 1e-9


def test_a_grasp_that_is_not_closed_or_not_there_is_refused():
    body = example_object("wedge")
    grasp = gc.plan(body, 0.5, limit=1).grasps[0]
    with pytest.raises(gc.InputError, match=r"must be in force closure at friction 0\.001"):
        gc.optimize_contacts(body, grasp, 0.001)
    with pytest.raises(gc.InputError, match="face"):
        gc.optimize_contacts(example_object("tetrahedron"), grasp, 0.5)
