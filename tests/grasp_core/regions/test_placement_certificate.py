"""Bounds on the chance of closure against draws of the motions themselves."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import special
from scipy.spatial.transform import Rotation

import grasp_core as gc
from grasp_core.geometry.polygons import plane_frame
from grasp_core.planning.given_contacts import grasp_of, seat
from grasp_core.regions.placement_certificate import LARGEST_DEVIATIONS, _chances_beyond, _limits
from scenes import example_object
from tests.placements import met, share_closed

SIZES = ((1e-3, 1.0), (2e-3, 2.0), (4e-3, 4.0))
"""Deviations of translation [m] and turn [deg]."""


def bounds(name, family, shift=0.0, limit=1):
    """Bounds for grasps of an object, for each of the sizes."""
    body = example_object(name)
    for grasp in gc.plan(body, 0.5, families=family, limit=limit).grasps:
        for metres, degrees in SIZES:
            found = gc.placement_probability(
                body, grasp, (0.5, 0.05), pose_sigma_m=metres, pose_sigma_rad=math.radians(degrees),
                contact_sigma_m=shift,
            )  # fmt: skip
            if found is not None:
                yield body, found


@pytest.mark.parametrize(
    ("name", "family"),
    [("wedge", "concurrent"), ("l-bracket", "pencil"), ("dodecahedron", "regulus")],
)
def test_fingers_that_meet_the_object_are_closed_as_often_as_proved(name, family):
    cases = list(bounds(name, family, shift=5e-4))
    assert len(cases) == len(SIZES)
    for body, found in cases:
        assert found.verify()
        rate = share_closed(body, found, 2000, seed=3)
        assert found.lower <= rate + 4.0 * math.sqrt(rate * (1.0 - rate) / 2000) + 1e-3
    assert cases[0][1].lower > 0.98
    assert cases[0][1].lower > cases[1][1].lower > cases[2][1].lower


def test_series_are_above_the_exact_motions():
    """The exact slide and place of each draw within the reach are at most g.z + z'Hz."""
    (_, found), *_ = bounds("l-bracket", "concurrent", shift=1e-3)
    rng, off = np.random.default_rng(0), found.off
    z = 1.5 * rng.normal(size=(4000, 14))
    moves = z[:, :6] @ off.root.T
    R = Rotation.from_rotvec(moves[:, 3:]).as_matrix()
    g, H, b = _limits(found)
    row, tested = 0, 0
    for i, (x, n) in enumerate(zip(found.positions, found.normals, strict=True)):
        frame, d = plane_frame(n), x - found.center
        own = z[:, 6 + 2 * i : 8 + 2 * i]
        e = off.contact_sigma * own @ frame.T
        turned = R @ n
        num = n @ d - np.einsum("ni,ni->n", turned, d + e - moves[:, :3])
        s = num / (turned @ n)
        y = np.einsum("nji,nj->ni", R, d + e - moves[:, :3] + s[:, None] * n) - d
        E, _ = found.edges(i)
        lost = found.slides[i] * (1.0 - turned @ n)
        exact = [num + lost, lost - num, *(y @ E.T).T]
        u = np.hstack([z[:, :6], own])
        there = (
            (np.linalg.norm(moves[:, 3:], axis=1) <= off.turn)
            & (np.linalg.norm(e, axis=1) <= found.shift)
            & (
                np.linalg.norm(moves[:, :3], axis=1)
                <= LARGEST_DEVIATIONS * np.linalg.norm(off.root[:3], 2)
            )
        )
        for values in exact:
            series = u @ g[row] + np.einsum("ni,ij,nj->n", u, H[row], u)
            assert (values[there] <= series[there] + 1e-15).all()
            tested += int(there.sum())
            row += 1
    assert row == len(b)
    assert tested > 10_000


def test_chances_that_limits_are_broken_are_not_below_what_draws_show():
    rng, count = np.random.default_rng(1), 20_000
    for _ in range(20):
        g = rng.normal(size=(8, 8))
        H = np.zeros((8, 8, 8))
        H[:, 3:6] = 0.05 * rng.normal(size=(8, 3, 8))
        H += H.swapaxes(1, 2)
        b = rng.uniform(1.0, 4.0, size=8) * np.linalg.norm(g, axis=1)
        z = rng.normal(size=(count, 8))
        rates = (z @ g.T + np.einsum("ni,kij,nj->nk", z, H, z) > b).mean(axis=0)
        told = _chances_beyond(g, H, b, special)
        assert (told >= rates - 4.0 * np.sqrt(rates / count) - 1e-4).all()
        alone = _chances_beyond(g, 0.0 * H, b, special)
        exact = special.ndtr(-b / np.linalg.norm(g, axis=1))
        assert (alone >= exact).all()
        assert np.allclose(alone, exact, rtol=1e-9, atol=1e-11)


def test_a_proof_without_a_landing_is_refused():
    (_, found), *_ = bounds("wedge", "concurrent")
    for landing in (np.empty((0, 3)), np.zeros((3, 3)), found.landings[0][::-1]):
        changed = replace(found, landings=(landing, *found.landings[1:]))
        assert not changed.verify()
        assert changed.estimate == 0.0


def test_faces_off_their_planes_by_rounding_are_not_in_the_way_of_fingers():
    """The object is one as a file of single precision holds it."""
    box = example_object("box")
    turn = Rotation.from_rotvec([0.3, -0.7, 0.4]).as_matrix()
    points = (box.vertices @ turn.T).astype(np.float32).astype(float)
    body = gc.Polyhedron.from_mesh(points, box.triangles)
    off = {"pose_sigma_m": 1e-3, "pose_sigma_rad": 0.0175}
    exact, rounded = (
        gc.placement_probability(each, gc.plan(each, 0.5, limit=1).grasps[0], 0.5, **off).lower
        for each in (box, body)
    )
    assert rounded == pytest.approx(exact, abs=1e-3)
    assert exact > 0.99


DECIMALS = (6, 8, 9)


def truncated_pyramid():
    """A triangular frustum whose sides lean over its base, turned out of its axes."""
    angles = np.array([0.25, 1.69, 3.99])
    ring = np.column_stack([np.cos(angles), np.sin(angles)])
    base, top = 0.030 * ring, 0.019 * ring + 0.001
    points = np.vstack([np.c_[base, np.zeros(3)], np.c_[top, np.full(3, 0.04)]])
    triangles = [[0, 2, 1], [3, 4, 5]]
    for i, j in ((0, 1), (1, 2), (2, 0)):
        triangles += [[i, j, 3 + j], [i, 3 + j, 3 + i]]
    return points @ Rotation.from_rotvec([0.3, -0.7, 0.4]).as_matrix().T, triangles


def read_with(path, points, triangles, form):
    """The object that a text file holds whose coordinates are written in a form."""
    lines = [f"v {x:{form}} {y:{form}} {z:{form}}" for x, y, z in points.tolist()]
    lines += ["f " + " ".join(str(corner + 1) for corner in each) for each in triangles]
    path.write_text("\n".join(lines))
    return gc.load_polyhedron(path)


def test_corners_that_rounding_lifts_hide_no_face_behind_them(tmp_path):
    """A neighbour that shares a lifted corner and leans over the face covers a strip only."""
    points, triangles = truncated_pyramid()
    single = points.astype(np.float32).astype(float)
    exact = read_with(tmp_path / "exact.obj", points, triangles, ".17g")
    rounded = [read_with(tmp_path / f"{n}.obj", points, triangles, f".{n}f") for n in DECIMALS]
    rounded.append(read_with(tmp_path / "single.obj", single, triangles, ".9g"))
    off, compared = {"pose_sigma_m": 1e-3, "pose_sigma_rad": 0.0175}, 0
    for grasp in gc.plan(exact, 0.5, families=("concurrent", "pencil"), limit=4).grasps:
        bound = gc.placement_probability(exact, grasp, 0.6, **off).lower
        for body in rounded:
            seated = grasp_of(seat(body, grasp.positions, grasp.normals), 0.5, grasp.id)
            found = gc.placement_probability(body, seated, 0.6, **off)
            assert found.lower == pytest.approx(bound, abs=0.01)
            rate = share_closed(body, found, 500, seed=3)
            assert found.lower <= rate + 4.0 * math.sqrt(rate * (1.0 - rate) / 500) + 1e-3
            compared += 1
        assert bound > 0.9
    assert compared == 16


def test_the_estimate_is_the_share_of_draws_that_end_on_landings_and_are_closed():
    """The definition with other draws: on a convex object, rays that end within a landing."""
    *_, (body, found) = bounds("wedge", "pencil", shift=5e-4)
    assert found.estimate < share_closed(body, found, 1000, seed=5) - 0.3
    rate = share_closed(body, found, 4000, seed=5, landed=True)
    luck = 4.0 * math.sqrt(rate * (1.0 - rate) * (1 / 4000 + 1 / 2000))
    assert abs(found.estimate - rate) <= luck + 1e-3


@pytest.mark.parametrize(
    "off",
    [{}, {"contact_sigma_m": 5e-4}, {"pose_sigma_m": (0.0, 0.0, 1e-4)},
     {"pose_sigma_rad": (0.0, 0.0, 1e-3)}],
)  # fmt: skip
def test_errors_that_move_no_contact_along_its_finger_are_harmless(off):
    body = example_object("box")
    found = gc.placement_probability(body, gc.plan(body, 0.5, limit=1).grasps[0], 0.5, **off)
    assert found.lower > 0.9
    assert found.verify()


def shaded(body, grasp):
    """Whether parts of the object are in front of a face that a finger stands on."""
    heights = np.einsum("kvi,ki->kv", grasp.positions[:, None] - body.vertices, grasp.normals)
    return heights.max() > 1e-6 * body.radius


@pytest.mark.parametrize("name", ["l-bracket", "cross"])
def test_nothing_is_in_the_way_of_fingers_to_the_landings(name):
    """Rays to points of landings, turned by up to T, meet the object first there."""
    rng, body, areas = np.random.default_rng(0), example_object(name), []
    grasps = [each for each in gc.plan(body, 0.5, limit=120).grasps if shaded(body, each)]
    for grasp in grasps[:: max(len(grasps) // 8, 1)]:
        found = gc.placement_probability(
            body, grasp, 0.5, pose_sigma_m=0.01 * body.radius, pose_sigma_rad=0.03, max_cones=300
        )
        if found is None:
            continue
        away = 3.0 * float(found.slides.max())
        for face, n, landing in zip(grasp.faces, found.normals, found.landings, strict=True):
            points = rng.dirichlet(np.full(len(landing), 0.3), size=100) @ landing
            points += 1e-6 * (landing.mean(axis=0) - points)
            aside = plane_frame(n) @ rng.normal(size=(2, 100))
            aside *= rng.uniform(size=100) / np.linalg.norm(aside, axis=0)
            ways = n + math.tan(found.off.turn) * aside.T
            ways /= np.linalg.norm(ways, axis=1, keepdims=True)
            starts = points - away * rng.uniform(0.01, 1.0, size=(100, 1)) * ways
            hits, _ = met(body, starts, ways)
            assert np.abs(hits - points).max() <= 1e-7 * body.radius
            areas.append(area(landing) / max(map(area, body.faces[face].pieces)))
    assert len(areas) >= 16
    assert min(areas) < 0.95


def area(polygon):
    sides = polygon[1:] - polygon[0]
    return np.linalg.norm(np.cross(sides[:-1], sides[1:]).sum(axis=0))
