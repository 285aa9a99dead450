"""Contacts of links: closed forms, Minkowski differences, and MuJoCo's own kinematics."""

from itertools import product

import mujoco
import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from grasp_core.objects.convex_pieces import pieced_object
from grasp_core.objects.on_faces import nearest_on_triangles
from scenes.mujoco.hand_contacts import ContactFinder
from scenes.mujoco.published_tests import TestedObject
from scenes.mujoco_options import PhysicsSettings
from tests.scenes.mujoco.test_filed_hand import JOINTS, ROOTS, filed, random_angles

NEAR_M = 0.01
LINK = """<mujoco><asset>{asset}</asset><worldbody>
<body name="link"><joint name="turn" axis="1 0 0"/><geom {shape}/></body>
<body name="other" pos="0 0 {apart}"><joint type="slide" axis="0 0 1"/><geom size=".01"/></body>
</worldbody></mujoco>"""


def box(*half_sizes, at=(0.0, 0.0, 0.0)):
    return np.array(list(product((-1.0, 1.0), repeat=3))) * half_sizes + at


def text_of(points):
    return " ".join(map(repr, points.ravel().tolist()))


def finder_of(folder, shape, pieces, points=None, apart=1.0, near_m=NEAR_M):
    """A finder of contacts of a link with one shape, and of a ball a way above it."""
    asset = "" if points is None else f'<mesh name="own" vertex="{text_of(points)}"/>'
    hand = filed(folder, LINK.format(asset=asset, shape=shape, apart=apart))
    made = pieced_object(pieces)
    tested = TestedObject(made.body, 0.5, 0.1, PhysicsSettings(), made.pieces)
    return ContactFinder(tested.by_filed_hand(hand), hand, made.body, near_m)


def pose(position, turn=None):
    found = np.eye(4)
    found[:3, 3] = position
    found[:3, :3] = np.eye(3) if turn is None else turn
    return found


def links_of(stood):
    return [(each.link, each.distance_m) for each in stood.contacts]


FIVE = np.array([[0, 0, -0.01], [0.01, 0, 0], [-0.01, 0.01, 0], [-0.01, -0.01, 0], [0, 0, 0.02]])
SHAPES = {
    "sphere": ('type="sphere" size=".01"', None),
    "capsule": ('type="capsule" size=".006 .004"', None),
    "box": ('type="box" size=".01 .02 .01"', None),
    "cylinder": ('type="cylinder" size=".02 .01"', None),
    "ellipsoid": ('type="ellipsoid" size=".02 .03 .01"', None),
    "mesh": ('type="mesh" mesh="own"', FIVE),
}
"""Shapes that reach 10 mm below the origin of their link."""
ONE, TWO = [box(0.04, 0.04, 0.02)], [
    box(0.02, 0.04, 0.02, at=(-0.02, 0, 0)), box(0.02, 0.04, 0.02, at=(0.02, 0, 0)),
]  # fmt: skip
"""A block of 80, 80 and 40 mm, as one piece, and as two that touch in the plane x = 0."""
APART = [TWO[0], TWO[1] + [1e-6, 0.0, 0.0]]
"""The two with a gap between them, as files with six digits leave it."""
BLOCKS = {"one piece": ONE, "two pieces": TWO, "a gap": APART}


@pytest.mark.parametrize("kind", SHAPES)
@pytest.mark.parametrize("height", [0.003, 1e-6, -1e-6, -0.003])
@pytest.mark.parametrize("blocks", BLOCKS)
def test_a_link_above_or_in_a_block_has_the_height_as_its_distance(kind, height, blocks, tmp_path):
    """Away from the seam of two pieces as on it: no contact with a side within the object.

    A tip that is deeper than it is beside the seam has a shorter way out of each piece.
    """
    shape, points = SHAPES[kind]
    finder = finder_of(tmp_path, shape, BLOCKS[blocks], points)
    for x in (-0.015, -0.004, 0.02) if kind == "mesh" else (-0.015, -0.004, 0.0, 0.0005, 0.02):
        stood = finder.stood(pose((x, 0.01, 0.03 + height)), np.zeros(2))
        assert stood.contacts[0].distance_m == pytest.approx(height, abs=1e-7)
        assert stood.depth_m == pytest.approx(max(0.0, -height), abs=1e-7)
        assert stood.own_depth_m == 0.0
        for each in stood.contacts:
            assert each.link == "hand/link"
            np.testing.assert_allclose(each.contact.normal, [0, 0, -1], atol=1e-5)
            assert each.contact.position[2] == pytest.approx(0.02, abs=1e-6)
            assert abs(each.contact.position[0] - x) < 0.021
        flat = kind in {"box", "cylinder"}
        if not flat:
            (only,) = stood.contacts
            np.testing.assert_allclose(only.contact.position[:2], [x, 0.01], atol=1e-5)
        else:
            spread = np.ptp([each.contact.position for each in stood.contacts], axis=0)
            assert spread[0] > 0.015
            assert spread[1] > 0.025


def test_a_capsule_on_a_face_touches_at_both_ends(tmp_path):
    finder = finder_of(tmp_path, 'type="capsule" size=".01" fromto="-.01 0 0 .01 0 0"', ONE)
    ends = sorted(
        each.contact.position[0] for each in finder.stood(pose((0, 0, 0.031)), np.zeros(2)).contacts
    )
    np.testing.assert_allclose(ends, [-0.01, 0.01], atol=1e-6)
    tilted = Rotation.from_euler("y", 10, degrees=True).as_matrix()
    (low,) = finder.stood(pose((0, 0, 0.033), tilted), np.zeros(2)).contacts
    height = 0.033 - 0.01 * np.sin(np.radians(10.0)) - 0.01 - 0.02
    assert low.distance_m == pytest.approx(height, abs=1e-7)


def test_an_edge_beside_which_a_piece_goes_on_is_no_contact(tmp_path):
    """A ball in the corner of an L touches both walls, and not the edge where the pieces meet."""
    pieces = [box(0.04, 0.04, 0.02), box(0.02, 0.04, 0.04, at=(0.06, 0, 0.02))]
    finder = finder_of(tmp_path, 'size=".01"', pieces)
    found = finder.stood(pose((0.04 - 0.0102, 0.0, 0.03 + 0.0001)), np.zeros(2)).contacts
    assert [each.distance_m for each in found] == pytest.approx([1e-4, 2e-4], abs=1e-7)
    np.testing.assert_allclose(
        [each.contact.normal for each in found], [[0, 0, -1], [1, 0, 0]], atol=1e-6
    )


def test_what_is_farther_than_asked_is_no_contact(tmp_path):
    finder = finder_of(tmp_path, 'size=".01"', ONE, near_m=0.002)
    assert links_of(finder.stood(pose((0, 0, 0.0321)), np.zeros(2))) == []
    assert links_of(finder.stood(pose((0, 0, 0.0319)), np.zeros(2))) == [
        ("hand/link", pytest.approx(0.0019))
    ]


@pytest.mark.parametrize("overlap", [-0.001, 0.001, 0.004])
def test_links_stand_in_each_other(overlap, tmp_path):
    finder = finder_of(tmp_path, 'size=".02"', ONE, apart=0.03)
    stood = finder.stood(pose((0.0, 0.0, 0.5)), np.array([0.3, -overlap]))
    assert stood.own_depth_m == pytest.approx(max(0.0, overlap), abs=1e-9)
    assert (stood.contacts, stood.depth_m) == ((), 0.0)


def minkowski(one, other):
    """Signed distance of two hulls, the direction from one to the other, and what is next best."""
    apart = ConvexHull((other[:, None] - one[None]).reshape(-1, 3))
    heights = apart.equations[:, 3]
    if (heights < 0.0).all():  # the origin is inside: the nearest facet is the way out
        order = np.argsort(-heights)
        facet = apart.equations[order[0], :3]
        others = apart.equations[:, :3] @ facet < 1.0 - 1e-6
        return heights[order[0]], -facet, heights[others].max()
    corners = apart.points[apart.simplices]
    nearest = nearest_on_triangles(corners, np.zeros(3))
    best = nearest[np.linalg.norm(nearest, axis=1).argmin()]
    return np.linalg.norm(best), best / np.linalg.norm(best), -np.inf


CORES = {
    "sphere": ('type="sphere" size=".012"', np.zeros((1, 3)), 0.012),
    "capsule": ('type="capsule" size=".008 .02"', np.array([[0, 0, -0.02], [0, 0, 0.02]]), 0.008),
    "box": ('type="box" size=".008 .012 .02"', box(0.008, 0.012, 0.02), 0.0),
    "mesh": ('type="mesh" mesh="own"', None, 0.0),
}
"""Shapes as hulls with a radius."""


@pytest.mark.parametrize("kind", CORES)
def test_contacts_of_random_shapes_are_those_of_minkowski_differences(kind, tmp_path):
    rng = np.random.default_rng(0)
    shape, core, radius = CORES[kind]
    counts = {True: 0, False: 0}
    for _ in range(10):
        points = rng.normal(size=(12, 3)) * 0.012
        own = points if core is None else core
        piece = rng.normal(size=(15, 3))
        piece *= rng.uniform(0.02, 0.04, 3) / np.linalg.norm(piece, axis=1, keepdims=True)
        finder = finder_of(tmp_path, shape, [piece], points, near_m=0.03)
        for _ in range(5):
            turn, way = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3)
            place = way / np.linalg.norm(way) * rng.uniform(0.02, 0.05)
            stood = finder.stood(pose(place, turn), np.zeros(2))
            core_apart, normal, next_best = minkowski(own @ turn.T + place, piece)
            apart = core_apart - radius
            if apart > 0.03 or core_apart - next_best < 1e-4:
                continue
            first = stood.contacts[0]
            assert first.distance_m == pytest.approx(apart, abs=5e-5)
            assert stood.depth_m == pytest.approx(max(0.0, -apart), abs=5e-5)
            assert np.degrees(np.arccos(min(1.0, first.contact.normal @ normal))) < 1.0
            surface = finder.body.vertices[finder.body.triangles]
            off = nearest_on_triangles(surface, first.contact.position) - first.contact.position
            assert np.linalg.norm(off, axis=1).min() < 1e-6
            counts[bool(apart > 0.0)] += 1
    assert min(counts.values()) >= 10


def test_levers_are_the_motion_of_points_by_differences(tmp_path):
    hand = filed(tmp_path, ROOTS["free"][0])
    made = pieced_object(TWO)
    tested = TestedObject(made.body, 0.5, 0.1, PhysicsSettings(), made.pieces)
    finder = ContactFinder(tested.by_filed_hand(hand), hand, made.body, 0.1)
    model = mujoco.MjModel.from_xml_string(ROOTS["free"][0])
    angles, rng = random_angles(np.random.default_rng(3)), np.random.default_rng(4)
    root = pose((0.01, 0.02, 0.1), Rotation.random(rng=rng).as_matrix())
    stood = finder.stood(root, np.array(list(angles.values())))
    assert len({each.link for each in stood.contacts}) > 4

    def moved(link, local, joint, step):
        data = mujoco.MjData(model)
        for name, angle in angles.items():
            data.joint(name).qpos[0] = angle + step * (name == joint)
        mujoco.mj_kinematics(model, data)
        body = data.body(link)
        return root[:3, :3] @ (body.xmat.reshape(3, 3) @ local + body.xpos) + root[:3, 3]

    def own(link, point):
        data = mujoco.MjData(model)
        for name, angle in angles.items():
            data.joint(name).qpos[0] = angle
        mujoco.mj_kinematics(model, data)
        body = data.body(link)
        return body.xmat.reshape(3, 3).T @ (root[:3, :3].T @ (point - root[:3, 3]) - body.xpos)

    for each in stood.contacts:
        link, step = each.link.removeprefix("hand/"), 1e-6
        local = own(link, each.contact.position)
        by_steps = [
            (moved(link, local, joint, step) - moved(link, local, joint, -step)) / (2.0 * step)
            for joint in JOINTS
        ]
        np.testing.assert_allclose(each.lever, by_steps, atol=1e-8)
    levers = finder.levers(stood.contacts[:2])
    np.testing.assert_array_equal(
        levers, np.hstack([stood.contacts[0].lever, stood.contacts[1].lever])
    )
    assert finder.levers(()).shape == (len(JOINTS), 0)


def test_every_link_that_is_near_is_found_with_its_distance(tmp_path):
    """Beside MuJoCo's distances of all pairs of shapes, whatever it looks for by itself."""
    hand, made = filed(tmp_path, ROOTS["free"][0]), pieced_object(TWO)
    tested = TestedObject(made.body, 0.5, 0.1, PhysicsSettings(), made.pieces)
    finder = ContactFinder(tested.by_filed_hand(hand), hand, made.body, NEAR_M)
    model, data, rng, count = finder.model, finder.data, np.random.default_rng(0), 0
    of_object = model.geom_bodyid == finder.object
    solids = np.flatnonzero(of_object & (model.geom_contype > 0)).tolist()
    for _ in range(50):
        way = rng.normal(size=3)
        root = pose(
            way / np.linalg.norm(way) * rng.uniform(0.06, 0.15),
            Rotation.random(rng=rng).as_matrix(),
        )
        found = finder.stood(root, np.array(list(random_angles(rng).values()))).contacts
        least = {each.link: each.distance_m for each in found[::-1]}
        apart = {}
        for shape in np.flatnonzero(~of_object).tolist():
            link = model.body(int(model.geom_bodyid[shape])).name
            ends = np.empty(6)
            gaps = [mujoco.mj_geomDistance(model, data, one, shape, 1.0, ends) for one in solids]
            apart[link] = min(*gaps, apart.get(link, 1.0))
        near = {link: gap for link, gap in apart.items() if 0.0 < gap < NEAR_M}
        assert {link: least.get(link) for link in near} == pytest.approx(near, abs=1e-6)
        count += len(near)
    assert count > 20
