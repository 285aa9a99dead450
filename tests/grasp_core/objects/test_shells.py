"""Closed parts of a mesh become one solid, or are refused with advice."""

from itertools import product

import numpy as np
import pytest
import trimesh
from scipy import ndimage

import grasp_core as gc
from grasp_core.errors import MeshRefusal
from grasp_core.planning.given_contacts import facets_of

UNIT = 0.01
"""Side of the cubes that boxes are counted in [m]."""
CELLS = 8
WHOLE = ((0, 0, 0), (6, 6, 6))


def box(low, high):
    """The vertices [m] and triangles of a box between two corners, in units."""
    low, high = np.array(low, dtype=float), np.array(high, dtype=float)
    mesh = trimesh.creation.box(high - low)
    return UNIT * (mesh.vertices + 0.5 * (low + high)), mesh.faces


def turned(part):
    return part[0], part[1][:, ::-1]


def load(*parts, **choices):
    """One body of several meshes in one list of triangles."""
    return gc.Polyhedron.from_mesh(*trimesh.util.append_faces(*zip(*parts, strict=True)), **choices)


def refused(reason, words, *parts, **choices):
    with pytest.raises(gc.MeshError, match=words) as caught:
        load(*parts, **choices)
    assert caught.value.reason is reason


def cells(boxes):
    """The cells that are inside of at least one box, and those inside of each."""
    each = np.zeros((len(boxes), CELLS, CELLS, CELLS), dtype=bool)
    for filled, (low, high) in zip(each, boxes, strict=True):
        filled[tuple(slice(a, b) for a, b in zip(low, high, strict=True))] = True
    return each.any(axis=0), each


def surface_cells(filled):
    """Number of the sides of filled cells beyond which nothing is filled."""
    padded = np.pad(filled, 1).astype(int)
    return sum(int(np.abs(np.diff(padded, axis=axis)).sum()) for axis in range(3))


@pytest.mark.parametrize("seed", range(10))
def test_boxes_in_one_file_become_the_solid_that_cells_count(seed):
    rng = np.random.default_rng(seed)
    corners = [np.sort(np.array([rng.choice(CELLS, 2, replace=False) for _ in range(3)]), axis=1)
               for _ in range(3)]  # fmt: skip
    boxes = [(low, high) for low, high in (pair.T for pair in corners)]
    filled, each = cells(boxes)
    nested = any((each[i] <= each[j]).all() for i, j in product(range(3), repeat=2) if i != j)
    apart = ndimage.label(filled)[1] > 1
    parts = [box(low, high) for low, high in boxes]
    if nested or apart:
        refused(MeshRefusal.OVERLAP if nested else MeshRefusal.SEPARATE, "parts|solids", *parts)
        return
    body = load(*parts)
    assert body.volume == pytest.approx(filled.sum() * UNIT**3, rel=1e-9)
    middle = UNIT * (np.argwhere(filled).mean(axis=0) + 0.5)
    np.testing.assert_allclose(body.center_of_mass, middle, atol=1e-9)
    area = surface_cells(filled) * UNIT**2
    assert sum(face.area for face in body.faces) == pytest.approx(area, rel=1e-6)
    assert body.notes == ("3 parts that overlap or touch were united",)


@pytest.mark.parametrize("turn", [False, True])
def test_a_cavity_that_is_wound_inwards_stays_one(turn):
    parts = [box(*WHOLE), turned(box((2, 2, 2), (4, 4, 4)))]
    body = load(*(map(turned, parts) if turn else parts))
    assert body.volume == pytest.approx((216 - 8) * UNIT**3)
    assert any("inside out" in note for note in body.notes) is turn


def test_no_finger_stands_in_a_void_that_is_sealed_from_the_outside(tmp_path):
    outside, void = box(*WHOLE), turned(box((1, 2, 2), (4, 4, 4)))
    body = load(outside, void)
    assert len(body.faces) == 6
    assert sum(face.area for face in body.faces) == pytest.approx(6 * 36 * UNIT**2)
    np.testing.assert_allclose(body.center_of_mass[0], UNIT * (216 * 3 - 12 * 2.5) / 204)
    assert body.notes[-1].startswith("1 void of 12 cm^3 sealed from the outside")
    plan = gc.plan(body, 0.5, limit=5)
    again = gc.load_grasps(gc.save_grasps(tmp_path / "grasps.json", plan)).body
    assert (len(again.faces), again.notes) == (6, body.notes)
    plates = [box(low, high) for low, high in (
        ((0, 0, 0), (6, 6, 1)), ((0, 0, 5), (6, 6, 6)), ((0, 0, 1), (6, 1, 5)),
        ((0, 5, 1), (6, 6, 5)), ((0, 1, 1), (1, 5, 5)), ((5, 1, 1), (6, 5, 5)))]  # fmt: skip
    assert len(load(*plates).faces) == 6
    assert len(load(*plates[:5]).faces) == 11


@pytest.mark.parametrize("hole", [0, 40])
def test_a_finger_on_a_curved_surface_may_stand_in_no_sealed_void_either(hole):
    """Inside an open surface, too, a closed part that is wound inwards bounds a void."""
    outer, inner = (trimesh.creation.icosphere(subdivisions=3, radius=r) for r in (0.05, 0.04))
    below = np.argsort(outer.triangles_center[:, 2])[hole:]
    body = load((outer.vertices, outer.faces[below]), (inner.vertices, inner.faces[:, ::-1]))
    assert body.surface.closed is not bool(hole)
    assert len(body.surface.caps) == len(inner.faces)
    assert all(np.linalg.norm(face.centroid) > 0.045 for face in body.faces)
    corners = facets_of(body).corners
    assert np.linalg.norm(corners.mean(axis=1), axis=1).min() > 0.045


def test_a_part_in_a_cavity_is_apart():
    parts = [box(*WHOLE), turned(box((1, 1, 1), (5, 5, 5))), box((2, 2, 2), (4, 4, 4))]
    refused(MeshRefusal.SEPARATE, "2 solids", *parts)
    assert load(*parts, largest_part=True).volume == pytest.approx((216 - 64) * UNIT**3)


def test_a_part_inside_the_material_is_refused_with_advice_on_cavities():
    inner = box((2, 2, 2), (4, 4, 4))
    refused(
        MeshRefusal.OVERLAP, "turn the triangles of those that are cavities", box(*WHOLE), inner
    )
    body = load(box(*WHOLE), inner, largest_part=True)
    assert body.volume == pytest.approx(216 * UNIT**3)
    assert body.surface.dropped == pytest.approx(24 / (216 + 24))


def test_the_same_part_twice_is_one_and_its_opposite_encloses_nothing():
    body = load(box(*WHOLE), box(*WHOLE))
    assert body.volume == pytest.approx(216 * UNIT**3)
    assert body.notes == ("dropped 12 triangles that were there twice",)
    refused(MeshRefusal.ZERO_VOLUME, "encloses only", box(*WHOLE), turned(box(*WHOLE)))


def test_a_part_that_is_inside_out_is_turned_if_it_touches_and_refused_if_it_overlaps():
    body = load(box(*WHOLE), turned(box((6, 1, 2), (9, 4, 5))))
    assert body.volume == pytest.approx((216 + 27) * UNIT**3)
    assert body.notes[0] == "a part that was inside out was turned"
    crossing = turned(box((3, 1, 2), (9, 4, 5)))
    refused(MeshRefusal.WINDING, "one part is inside out", box(*WHOLE), crossing)
    whole = load(box(*WHOLE), crossing, largest_part=True)
    assert whole.volume == pytest.approx(216 * UNIT**3)
    beside = turned(box((8, 0, 0), (9, 1, 1)))
    refused(MeshRefusal.SEPARATE, "2 solids", box(*WHOLE), beside)
    whole = load(box(*WHOLE), beside, largest_part=True)
    assert whole.volume == pytest.approx(216 * UNIT**3)


@pytest.mark.parametrize("low", [(8, 0, 0), (2, 2, 2)], ids=["beside", "inside"])
@pytest.mark.parametrize("side", [0.59, 0.62])
def test_only_parts_with_next_to_no_area_are_left_out_without_being_asked_for(low, side):
    small = box(low, np.array(low) + side)
    share = side**2 / (36.0 + side**2)
    if share > 0.01:
        refused(MeshRefusal.SEPARATE if low[0] == 8 else MeshRefusal.OVERLAP, "part", box(*WHOLE),
                small)  # fmt: skip
    body = load(box(*WHOLE), small, largest_part=share > 0.01)
    assert body.volume == pytest.approx(216 * UNIT**3)
    assert body.surface.dropped == pytest.approx(share)
    assert body.notes == (f"1 part with {100.0 * share:.3g} % of the surface left out",)


def test_a_handle_that_is_open_is_united_with_its_closed_head_and_its_cap_bears_no_finger():
    points, faces = box((2.5, 2.5, -6), (3.5, 3.5, 3))
    heights = points[faces][:, :, 2]
    outer = (heights < -5.9 * UNIT).all(axis=1)
    inner = (heights > 2.9 * UNIT).all(axis=1)
    assert outer.sum() == inner.sum() == 2
    body = load(box(*WHOLE), (points, faces[~outer]))
    assert body.volume == pytest.approx((216 + 6) * UNIT**3)
    assert body.surface.volume_source == "capped surface"
    caps = body.vertices[body.triangles[body.surface.caps]]
    np.testing.assert_allclose(caps[..., 2], -6 * UNIT)
    assert len(body.faces) == 10, "six of the head and four of the handle"
    assert not any(face.centroid[2] < -5.9 * UNIT for face in body.faces)
    grasps = gc.plan(body, 0.5, limit=10).grasps
    assert grasps
    assert min(grasp.positions[:, 2].min() for grasp in grasps) > -5.999 * UNIT
    buried = load(box(*WHOLE), (points, faces[~inner]))
    assert buried.volume == pytest.approx((216 + 6) * UNIT**3)
    assert len(buried.surface.caps) == 0
    assert len(buried.faces) == 11


@pytest.mark.parametrize("side", [0.5, 4.0])
def test_debris_without_volume_is_left_out_if_it_is_small(side):
    points = UNIT * np.array([[8, 0, 0], [8 + side, 0, 0], [8, side, 0]], dtype=float)
    sheet = points, np.array([[0, 1, 2], [2, 1, 0]])
    if side > 1.0:
        refused(MeshRefusal.ZERO_VOLUME, "enclose almost no volume", box(*WHOLE), sheet)
    body = load(box(*WHOLE), sheet, largest_part=side > 1.0)
    assert body.volume == pytest.approx(216 * UNIT**3)
    assert body.surface.dropped == pytest.approx(side**2 / (216 + side**2))
