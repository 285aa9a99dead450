"""What stops a hand: each case has one cause, and without that cause the hand stands."""

import re
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

import grasp_core as gc
import scenes
from grasp_core.errors import InputError
from grasp_core.files.records import from_record, record_of
from grasp_core.hands.hand import LinkShape
from grasp_core.hands.hand_arrays import places
from grasp_core.hands.obstacles import REASONS
from grasp_core.hands.reach import HandReach
from tests.grasp_core.hands.gripping import FRICTION, grasps, scaled

HANDS_PAGE = Path(__file__).parents[3] / "docs" / "hands.md"
FEW = 20
"""Starts of searches that fail."""


def asked(hand, name, radius, which=0, **settings):
    """What a hand does in one of the grasps of an object."""
    grasp = grasps(name, radius)[which]
    return gc.reach_with(hand, scaled(name, radius), grasp, FRICTION, **settings)


def narrow(hand, share):
    """A hand whose joints turn in the middle parts of their ranges only."""

    def narrowed(joint):
        middle, half = 0.5 * (joint.lowest + joint.highest), 0.5 * (joint.highest - joint.lowest)
        return replace(joint, lowest=middle - share * half, highest=middle + share * half)

    return replace(hand, fingers=tuple(
        replace(finger, links=tuple(
            replace(link, joint=narrowed(link.joint)) for link in finger.links
        ))
        for finger in hand.fingers
    ))  # fmt: skip


def stopped(found, reason, *said):
    """Check the reason of a pose that was not found, and what its explanation says."""
    assert (found.reached, found.reason) == (False, reason), found.explanation
    assert all(words in found.explanation for words in said), found.explanation
    assert found.nearest is not None
    return found


def test_an_object_is_proved_to_be_too_small_or_too_large():
    """Fingertips of 12 mm do not fit on 5 mm, and links do not reach over a metre."""
    hand = gc.load_hand("allegro")
    # contacts lie in regions of faces, so that middles are at most this far apart
    small = stopped(asked(hand, "dodecahedron", 0.005, starts=FEW), "too small", "proves it")
    found = re.search(r"to be ([\d.]+) mm apart .* are ([\d.]+) mm", small.explanation)
    wanted, thick = map(float, found.groups())
    assert wanted < thick == 24.5  # two radii and the clearance
    large = stopped(asked(hand, "dodecahedron", 0.6, starts=FEW), "too large", "proves it")
    found = re.search(r"to be ([\d.]+) mm apart .* reach ([\d.]+) mm", large.explanation)
    wanted, longest = map(float, found.groups())
    assert wanted > longest
    rng, (low, high) = np.random.default_rng(0), hand.ranges.T
    tips = places(hand, rng.uniform(low, high, (500, len(low)))).tips
    widest = max(
        np.linalg.norm(a - b, axis=1).max() for a, b in combinations(tips.swapaxes(0, 1), 2)
    )
    assert 0.3 * longest < 1e3 * widest <= longest


def test_an_object_is_too_large_if_a_smaller_copy_is_not():
    hand = gc.load_hand("allegro")
    found = stopped(asked(hand, "dodecahedron", 0.08, starts=FEW), "too large", "on a copy")
    sizes = re.search(r"up to ([\d.]+) mm apart, .* up to ([\d.]+) mm", found.explanation)
    share = float(sizes[2]) / float(sizes[1])
    assert share == pytest.approx(0.5, rel=0.01)
    assert asked(hand, "dodecahedron", 0.04).reached


def test_narrow_ranges_of_joints_stop_a_hand():
    hand = gc.load_hand("allegro")
    found = stopped(
        asked(narrow(hand, 0.3), "dodecahedron", 0.035, starts=FEW), "limit",
        "ranges 45 degrees wider", "degrees beyond its range",
    )  # fmt: skip
    assert "limit" in found.nearest.too_near
    assert asked(hand, "dodecahedron", 0.035).reached


def test_a_part_of_the_palm_where_the_object_is_stops_a_hand():
    """Links may overlap each other here, so that they are no other cause beside the palm."""
    hand, body = gc.load_hand("allegro"), scaled("dodecahedron", 0.035)
    names = ["palm", *(link.name for link in hand.links)]
    hand = replace(hand, ignored_pairs=tuple(map(tuple, map(sorted, combinations(names, 2)))))
    free = asked(hand, "dodecahedron", 0.035, seed=2)
    assert free.reached
    middle = free.palm_pose[:3, :3].T @ (body.center_of_mass - free.palm_pose[:3, 3])
    ball = LinkShape(middle, np.eye(3), np.zeros(3), 0.04)
    found = stopped(
        asked(replace(hand, palm=(*hand.palm, ball)), "dodecahedron", 0.035, starts=FEW, seed=2),
        "palm", "the palm is in the way",
        "with a palm that may overlap the object the hand stands in the grasp",
    )  # fmt: skip
    assert found.starts == FEW


def test_links_that_overlap_each_other_stop_a_hand():
    hand, tiny = gc.load_hand("leap"), ("dodecahedron", 0.004)
    found = [asked(hand, *tiny, which, starts=FEW) for which in range(4)]
    missed = next(n for n, each in enumerate(found) if not each.reached)
    stopped(found[missed], "collision", "links are in the way of each other")
    pairs = tuple((a.name, b.name) for a, b in combinations(hand.links, 2))
    assert asked(replace(hand, ignored_pairs=pairs), *tiny, missed, starts=FEW).reached


def test_a_table_stops_a_hand_at_a_flat_object():
    hand, box = gc.load_hand("allegro"), scenes.example_object("box")
    flat = 0.05 * box.vertices / box.radius * [1.0, 1.0, 0.2]
    body = gc.Polyhedron.from_mesh(flat, box.triangles, name="flat")
    (grasp,) = gc.plan(body, FRICTION, limit=1).grasps
    down = (0.0, 0.0, -1.0)
    found = gc.reach_with(hand, body, grasp, FRICTION, table_down=down)
    stopped(found, "collision", "the table is in the way", "with no table")
    assert "table" in found.nearest.too_near
    assert gc.reach_with(hand, body, grasp, FRICTION).reached


def test_the_nearest_pose_is_as_far_off_as_it_says():
    hand = gc.load_hand("allegro")
    settings = {"regions": False, "starts": FEW}
    found = asked(hand, "dodecahedron", 0.005, **settings)
    near, (low, high) = found.nearest, hand.ranges.T
    assert ((low <= near.joints) & (near.joints <= high)).all()
    grasp = grasps("dodecahedron", 0.005)[0]
    tips = places(hand, near.joints, near.palm_pose).tips[0, near.fingers]
    wanted = grasp.positions[near.used] - 0.012 * grasp.normals[near.used]
    assert near.gaps_m == pytest.approx(np.linalg.norm(tips - wanted, axis=1), abs=1e-9)
    assert near.off_m >= np.linalg.norm(near.gaps_m) - 1e-12
    assert near.off_m > 1e-3
    assert asked(hand, "dodecahedron", 0.005, **settings) == found
    assert from_record(HandReach, record_of(found)) == found


def test_a_pose_and_a_nearest_pose_exclude_each_other():
    hand = gc.load_hand("allegro")
    near = asked(hand, "dodecahedron", 0.005, starts=1).nearest
    reached = asked(hand, "dodecahedron", 0.035)
    assert reached.nearest is None
    with pytest.raises(InputError, match="nearest must be None"):
        replace(reached, nearest=near)


def test_the_page_about_hands_lists_every_reason():
    rows = re.findall(r"^\| `([a-z ]+)` \|", HANDS_PAGE.read_text(), re.MULTILINE)
    assert [row for row in rows if row in REASONS] == list(REASONS)
