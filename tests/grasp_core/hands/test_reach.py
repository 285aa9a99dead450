"""A hand in a grasp: what is returned is true, and what was not found is not denied."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
import trimesh

import grasp_core as gc
from grasp_core.hands.distances.collisions import FAR, clearances
from grasp_core.hands.hand import Hand, HandFinger
from grasp_core.hands.kinematics import places
from grasp_core.hands.posing.pose_search import TOUCHING
from tests.grasp_core.hands.gripping import FRICTION, finger, grasps, plain_hand, reaches, scaled
from tests.marks import MORE

CASES = [("allegro", "dodecahedron", 0.035), ("leap", "dodecahedron", 0.035),
         ("allegro", "l-bracket", 0.04)]  # fmt: skip

TILTED = np.array([[1.0, 0.0, 0.0], [0.0, 0.8, -0.6], [0.0, 0.6, 0.8]])
"""A turn that leans z towards -y."""


def mesh_of(body):
    return trimesh.Trimesh(body.vertices, body.triangles, process=False)


def strewn(shape, rotation, position, count=9):
    """Points over a box with rounded edges, in the object's frame."""
    ticks = np.linspace(-1.0, 1.0, count)
    local = np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), -1).reshape(-1, 3)
    local = local[np.abs(local).max(axis=1) == 1.0] * shape.half_sizes
    return position + (shape.position + local @ shape.rotation.T) @ rotation.T


@pytest.mark.parametrize(("hand", "name", "radius"), CASES)
def test_most_grasps_are_reached_and_each_claim_holds(hand, name, radius):
    found, held, body = reaches(hand, name, radius), gc.load_hand(hand), scaled(name, radius)
    good = [each for each in found if each.reached]
    assert len(good) >= 3
    low, high = held.ranges.T
    for each, grasp in zip(found, grasps(name, radius), strict=True):
        if not each.reached:
            assert each.reason in {"limit", "collision", "not found"}
            assert each.joints is None
            continue
        assert each.grasp == grasp.id
        assert ((low <= each.joints) & (each.joints <= high)).all()
        pose = each.palm_pose
        assert pose[:3, :3] @ pose[:3, :3].T == pytest.approx(np.eye(3), abs=1e-9)
        tips = places(held, each.joints, pose).tips[0]
        assert len(set(each.fingers.tolist())) == 4
        for k, contact in enumerate(each.contacts):
            tip = held.fingers[each.fingers[k]].tip
            away = contact.position - tips[each.fingers[k]]
            assert np.linalg.norm(away) == pytest.approx(tip.radius, abs=TOUCHING)
            assert away / np.linalg.norm(away) == pytest.approx(contact.normal, abs=1e-6)
        points = np.array([contact.position for contact in each.contacts])
        normals = np.array([contact.normal for contact in each.contacts])
        assert gc.force_closure(points, normals, FRICTION).closed
        assert each.certificate.verify()
        assert all(each.within_regions)
        off = trimesh.proximity.closest_point_naive(mesh_of(body), points)[1]
        assert off.max() <= 1e-9


@pytest.mark.parametrize(
    ("hand", "name", "radius"),
    [CASES[0], pytest.param(*CASES[1], marks=MORE), CASES[2]],
)
def test_points_strewn_over_links_are_outside_the_object(hand, name, radius):
    held, body, seen = gc.load_hand(hand), scaled(name, radius), 0
    mesh = mesh_of(body)
    for each in reaches(hand, name, radius):
        if not each.reached:
            continue
        found = places(held, each.joints, each.palm_pose)
        frames = [(s, each.palm_pose[:3, :3], each.palm_pose[:3, 3]) for s in held.palm]
        frames += [
            (s, found.link_rotations[0, k], found.link_positions[0, k])
            for k, link in enumerate(held.links)
            for s in link.shapes
        ]
        for shape, rotation, position in frames:
            points = strewn(shape, rotation, position)
            near, away, triangles = trimesh.proximity.closest_point_naive(mesh, points)
            outward = np.einsum("ij,ij->i", points - near, mesh.face_normals[triangles])
            signed = np.where(outward >= 0.0, away, -away)
            assert signed.min() >= shape.radius - TOUCHING - 1e-9
        measured = clearances(held, body, each.joints, each.palm_pose, each.fingers)
        assert measured.itself >= 5e-4
        assert measured.object >= 0.0
        assert abs(measured.tips) <= TOUCHING
        seen += 1
    assert seen >= 3


@pytest.mark.parametrize(("hand", "name", "radius"), CASES[:2])
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


def test_the_same_seed_gives_the_same_pose():
    body, grasp = scaled("dodecahedron", 0.035), grasps("dodecahedron", 0.035)[0]
    again = gc.reach_with(gc.load_hand("allegro"), body, grasp, FRICTION)
    assert again == reaches("allegro", "dodecahedron", 0.035)[0]


def test_contacts_stay_the_planned_ones_without_regions():
    body, hand, seen = scaled("dodecahedron", 0.035), gc.load_hand("allegro"), 0
    for grasp in grasps("dodecahedron", 0.035):
        found = gc.reach_with(hand, body, grasp, FRICTION, regions=False)
        if found.reached:
            seen += 1
            points = np.array([contact.position for contact in found.contacts])
            assert points == pytest.approx(grasp.positions, abs=1e-8)
    assert seen >= 1


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


def test_an_object_that_is_too_large_is_not_reached_and_nothing_says_impossible():
    body = scaled("dodecahedron", 0.2)
    found = gc.reach_with(gc.load_hand("allegro"), body, grasps("dodecahedron", 0.2, 1)[0],
                          FRICTION, starts=20)  # fmt: skip
    assert not found.reached
    assert found.reason in {"limit", "collision", "not found"}
    assert "no pose was found" in found.explanation
    assert "impossible" not in found.explanation
    assert found.contacts is None


def test_a_hand_with_locked_joints_ends_at_its_limits():
    hand = gc.load_hand("allegro")
    locked = replace(
        hand,
        fingers=tuple(
            HandFinger(
                f.name,
                tuple(
                    replace(link, joint=replace(link.joint, lowest=middle, highest=middle))
                    for link in f.links
                    for middle in [0.5 * (link.joint.lowest + link.joint.highest)]
                ),
                f.tip,
            )
            for f in hand.fingers
        ),
    )
    body, grasp = scaled("dodecahedron", 0.035), grasps("dodecahedron", 0.035)[0]
    found = gc.reach_with(locked, body, grasp, FRICTION, starts=10)
    assert not found.reached
    assert found.reason in {"limit", "not found"}


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


def test_fingers_of_one_hand_that_overlap_are_told():
    """With all joints straight the plain fingers are 28 mm apart; one turned inwards overlaps."""
    hand, body = plain_hand(), scaled("dodecahedron", 0.035)
    pose = np.eye(4)
    pose[:3, 3] = 1.0
    none = np.empty(0, np.int64)
    # the boxes of neighbours are 40 - 12 mm apart, their balls 40 - 16: beyond what is measured
    assert clearances(hand, body, np.zeros(8), pose, none).itself == FAR
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
