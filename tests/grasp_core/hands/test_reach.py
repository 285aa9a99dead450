"""A hand in a grasp: what is returned is true, and what was not found is not denied."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
import trimesh

import grasp_core as gc
from grasp_core.hands.collisions import FAR_M, clearances, tip_distances, tip_gaps
from grasp_core.hands.hand import Hand, HandFinger
from grasp_core.hands.hand_arrays import places
from grasp_core.hands.obstacles import REASONS
from grasp_core.hands.pose_search import TIP_TOUCHING, AskedPose, starts
from grasp_core.objects.on_faces import SolidSurface
from tests.grasp_core.hands.gripping import FRICTION, finger, grasps, plain_hand, reaches, scaled

CASES = [
    ("leap", "dodecahedron", 0.035),
    pytest.param("allegro", "l-bracket", 0.04, marks=pytest.mark.slow),
]

TILTED = np.array([[1.0, 0.0, 0.0], [0.0, 0.8, -0.6], [0.0, 0.6, 0.8]])
"""A turn that leans z towards -y."""


def mesh_of(body):
    return trimesh.Trimesh(body.vertices, body.triangles, process=False)


def strewn(shape, rotation, position, count=5):
    """Points over a box with rounded edges, in the object's frame."""
    ticks = np.linspace(-1.0, 1.0, count)
    local = np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), -1).reshape(-1, 3)
    local = local[np.abs(local).max(axis=1) == 1.0] * shape.half_sizes
    return position + (shape.position + local @ shape.rotation.T) @ rotation.T


def placed_tip(hand, reach, finger):
    """Corners of a fingertip in the object's frame, (m, 3), and its rounding."""
    found = places(hand, reach.joints, reach.palm_pose)
    last = hand.links.index(hand.fingers[finger].links[-1])
    corners, rounding = hand.fingers[finger].tip.core
    turned, origin = found.link_rotations[0, last], found.link_positions[0, last]
    return origin + corners @ turned.T, rounding


@pytest.mark.parametrize(("hand", "name", "radius"), CASES)
def test_most_grasps_are_reached_and_each_claim_holds(hand, name, radius):
    found, held, body = reaches(hand, name, radius), gc.load_hand(hand), scaled(name, radius)
    good = [each for each in found if each.reached]
    assert len(good) >= 3
    low, high = held.ranges.T
    for each, grasp in zip(found, grasps(name, radius), strict=True):
        if not each.reached:
            assert each.reason in REASONS
            assert each.joints is None
            continue
        assert each.grasp == grasp.id
        assert ((low <= each.joints) & (each.joints <= high)).all()
        pose = each.palm_pose
        assert pose[:3, :3] @ pose[:3, :3].T == pytest.approx(np.eye(3), abs=1e-9)
        assert len(set(each.fingers.tolist())) == 4
        for f, contact in zip(each.fingers, each.contacts, strict=True):
            corners, rounding = placed_tip(held, each, f)
            ahead = (corners - contact.position) @ contact.normal
            assert ahead.max() == pytest.approx(-rounding, abs=TIP_TOUCHING)
            front = corners[ahead >= ahead.max() - 1e-6] - contact.position
            middle = front - ahead.max() * contact.normal
            # the contact is ahead of the farthest corner, or between several
            assert (middle.min(axis=0) <= 1e-6).all()
            assert (middle.max(axis=0) >= -1e-6).all()
        points = np.array([contact.position for contact in each.contacts])
        normals = np.array([contact.normal for contact in each.contacts])
        assert gc.force_closure(points, normals, FRICTION).closed
        assert each.certificate.verify()
        assert all(each.within_regions)
        off = trimesh.proximity.closest_point_naive(mesh_of(body), points)[1]
        assert off.max() <= 1e-9


@pytest.mark.parametrize(("hand", "name", "radius"), CASES)
def test_points_strewn_over_links_are_outside_the_object(hand, name, radius):
    held, body, seen = gc.load_hand(hand), scaled(name, radius), 0
    mesh = mesh_of(body)
    for each in reaches(hand, name, radius):
        if not each.reached or seen == 1:
            continue
        found = places(held, each.joints, each.palm_pose)
        frames = [(s, each.palm_pose[:3, :3], each.palm_pose[:3, 3]) for s in held.palm]
        frames += [
            (s, found.link_rotations[0, k], found.link_positions[0, k])
            for k, link in enumerate(held.links)
            for s in link.shapes
        ]
        # a block's cover is no part of the hand
        covers = {f.links[-1].shapes[-1] for f in held.fingers if f.tip.corners is not None}
        cloud = [(strewn(*frame), frame[0].radius) for frame in frames if frame[0] not in covers]
        cloud += [placed_tip(held, each, f) for f in range(len(held.fingers))]
        for points, thick in cloud:
            near, away, triangles = trimesh.proximity.closest_point_naive(mesh, points)
            outward = np.einsum("ij,ij->i", points - near, mesh.face_normals[triangles])
            signed = np.where(outward >= 0.0, away, -away)
            assert signed.min() >= thick - TIP_TOUCHING - 1e-9
        measured = clearances(held, body, each.joints, each.palm_pose, each.fingers)
        assert measured.itself >= 5e-4
        assert measured.object >= 0.0
        assert abs(measured.tips) <= TIP_TOUCHING
        seen += 1
    assert seen == 1


@pytest.mark.parametrize(("hand", "name", "radius"), CASES)
def test_an_open_hand_is_free_and_so_is_its_way_in(hand, name, radius):
    held, body, seen, ways = gc.load_hand(hand), scaled(name, radius), 0, 0
    for each in reaches(hand, name, radius):
        if each.pregrasp is None:
            continue
        seen += 1
        low, high = held.ranges.T
        assert ((low <= each.pregrasp) & (each.pregrasp <= high)).all()
        none = np.empty(0, np.int64)
        free = clearances(held, body, each.pregrasp, each.palm_pose, none)
        assert min(free.itself, free.object) >= 5e-4
        if each.approach is None:
            continue
        ways += 1
        for back in (0.004, 0.02, 0.06):
            pose = each.palm_pose.copy()
            pose[:3, 3] -= back * each.approach
            free = clearances(held, body, each.pregrasp, pose, none)
            assert min(free.itself, free.object) >= 5e-4
    assert seen >= 2
    assert ways >= (1 if hand == "allegro" else 0)  # the other often has to come in on a curve


def test_contacts_stay_the_planned_ones_without_regions():
    body, hand = scaled("dodecahedron", 0.035), gc.load_hand("allegro")
    tried = (
        (grasp, gc.reach_with(hand, body, grasp, FRICTION, regions=False))
        for grasp in grasps("dodecahedron", 0.035)
    )
    grasp, found = next(pair for pair in tried if pair[1].reached)
    points = np.array([contact.position for contact in found.contacts])
    assert points == pytest.approx(grasp.positions, abs=1e-8)


def test_above_a_table_every_part_stays_above_it():
    """The table is across the face from which the contacts are farthest."""
    body, hand, seen = scaled("box", 0.04), gc.load_hand("allegro"), 0
    for grasp in grasps("box", 0.04, 12)[1:4]:
        depths = [
            (grasp.positions - face.centroid) @ face.normal for face in body.faces
        ]  # fmt: skip
        up = body.faces[int(np.argmax(np.min(depths, axis=1)))].normal
        found = gc.reach_with(hand, body, grasp, FRICTION, table_down=-3.0 * up)
        if found.reached:
            seen += 1
            lowest = float((body.vertices @ up).min())
            measured = clearances(
                hand, body, found.joints, found.palm_pose, found.fingers, up, lowest
            )
            assert measured.table >= 5e-4
        else:
            assert found.reason
    assert seen >= 2


def test_a_hand_with_five_fingers_uses_four():
    body, grasp = scaled("dodecahedron", 0.035), grasps("dodecahedron", 0.035)[0]
    hand = gc.load_hand("allegro")
    extra = hand.fingers[1]
    fifth = HandFinger(
        "fifth",
        tuple(
            replace(link, name=f"fifth_{i}", joint=replace(
                link.joint, name=f"fifth_{i}",
                position=link.joint.position - ([0.0, 0.087, 0.002] if i == 0 else np.zeros(3)),
            ))
            for i, link in enumerate(extra.links)
        ),
        extra.tip,
    )  # fmt: skip
    five = Hand("five", hand.palm, (*hand.fingers, fifth), ignored_pairs=hand.ignored_pairs)
    found = gc.reach_with(five, body, grasp, FRICTION)
    assert found.reached
    assert len(set(found.fingers.tolist())) == 4
    assert len(found.joints) == 20


def test_a_block_that_is_moved_into_the_object_is_said_to_be_deep_in_it():
    hand, body, seen = gc.load_hand("leap"), scaled("dodecahedron", 0.035), 0
    for each in reaches("leap", "dodecahedron", 0.035):
        if not each.reached:
            continue
        seen += 1
        gaps, _, touched = tip_gaps(hand, body, each.joints, each.palm_pose, each.fingers)
        assert gaps == pytest.approx(np.zeros(4), abs=TIP_TOUCHING)
        assert touched == pytest.approx(np.array([c.position for c in each.contacts]))
        for k, contact in enumerate(each.contacts):
            pose = each.palm_pose.copy()
            pose[:3, 3] += 1e-3 * contact.normal
            inside, _, _ = tip_gaps(hand, body, each.joints, pose, each.fingers)
            # a corner beside an edge is less deep below the other face
            assert -1e-3 - 2.0 * TIP_TOUCHING <= inside[k] <= -4e-4
            moved = clearances(hand, body, each.joints, pose, each.fingers)
            assert moved.tips < -5e-5
            off = tip_distances(hand, each.joints, each.palm_pose, each.fingers, touched)
            assert off == pytest.approx(np.zeros(4), abs=TIP_TOUCHING)
    assert seen >= 3


def test_fingers_of_one_hand_that_overlap_are_told():
    """With all joints straight the plain fingers are 28 mm apart; one turned inwards overlaps."""
    hand, body = plain_hand(), scaled("dodecahedron", 0.035)
    pose = np.eye(4)
    pose[:3, 3] = 1.0
    none = np.empty(0, np.int64)
    # the boxes of neighbours are 40 - 12 mm apart, their balls 40 - 16: beyond what is measured
    assert clearances(hand, body, np.zeros(8), pose, none).itself == FAR_M
    leaning = replace(
        hand,
        fingers=(
            *hand.fingers[:3], finger("lean", (0.0, 0.12, 0.0), (0.04, 0.03), turn=TILTED),
        ),
    )  # fmt: skip
    # leaning by asin(0.6) towards the next, the ball's middle is 70 mm * 0.6 nearer: past it
    assert clearances(leaning, body, np.zeros(8), pose, none).itself < -0.005
    free = replace(leaning, ignored_pairs=tuple(
        (a.name, b.name) for a, b in combinations(leaning.links, 2)
    ))  # fmt: skip
    assert clearances(free, body, np.zeros(8), pose, none).itself > 0.005


def test_a_search_starts_alike_where_contacts_differ_by_rounding():
    """Linear algebra of another processor moves contacts by their last digits."""
    hand, rng = gc.load_hand("leap"), np.random.default_rng(0)
    for grasp in grasps("dodecahedron", 0.035):
        moved = grasp.positions * (1.0 + 1e-15 * rng.standard_normal((4, 3)))
        asked = AskedPose(hand, None, grasp, 0.5, gc.ReachSettings(starts=20))
        ways = [starts(asked, points, grasp.normals) for points in (grasp.positions, moved)]
        for (fingers, one), (same, other) in zip(*ways, strict=True):
            np.testing.assert_array_equal(fingers, same)
            for part in ("q", "palm", "origin"):
                np.testing.assert_array_equal(getattr(one, part), getattr(other, part))
            np.testing.assert_allclose(one.palm @ one.palm.T, np.eye(3), atol=1e-15)
            assert np.linalg.det(one.palm) > 0.0


def test_blocks_touch_faces_along_their_normals():
    """A block that is laid on an edge has a way to the object that is no face's normal."""
    body, hand = scaled("wedge", 0.038), gc.load_hand("leap")
    surface = SolidSurface(body.vertices, body.triangles)
    plan = gc.plan(body, 0.6, families=("concurrent",), limit=5)
    found = [gc.reach_with(hand, body, grasp, 0.6, seed=1) for grasp in plan.grasps]
    contacts = [contact for each in found for contact in each.contacts or ()]
    assert len(contacts) >= 12
    assert all(surface.holds(each.position, each.normal, 2e-5) for each in contacts)
