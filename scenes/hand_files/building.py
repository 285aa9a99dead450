"""Puts a hand together of what a model file says, with MuJoCo.

Fingers that have their first links in common get chains of their own: the first finger keeps the
links, and the others get copies without shapes and masses, whose joints follow those of the first
finger, so that all move as one link.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial
from itertools import combinations
from pathlib import Path

import numpy as np

from grasp_core.allowed_values import path_of, several, value_of
from grasp_core.arrays import Array
from grasp_core.errors import InputError, about
from grasp_core.hands.collisions import overlapping_pairs
from grasp_core.hands.hand import (
    FEWEST_FINGERS,
    MOST_FINGERS,
    PALM_NAME,
    Coupling,
    Hand,
    HandFinger,
    Joint,
    Link,
    LinkShape,
    name_of_copy,
)
from grasp_core.hands.hand_arrays import rotation_about
from grasp_core.messages import shown
from grasp_core.names import HANDS
from scenes.hand_files.fingers import (
    FingerChains,
    finger_chains,
    followers,
    joint_name,
    shared_motors,
    tip_of,
)
from scenes.hand_files.model import NO_MASS_KG, HandModel, compiled_hand
from scenes.hand_files.model_text import model_text, note

HAND_ENDINGS = (".xml", ".mjcf", ".urdf")
AS_BOXES = "shapes other than boxes, capsules and spheres are taken as their boxes"
CLOSE_BY = 2
"""Number of joints between links that may be built into each other, at most."""
FULL_TURN = np.pi
"""Largest angle of a joint for which the file states no range [rad]."""


def hand_from_file(path: str | Path, fingertips: Iterable[str]) -> Hand:
    """Make the hand that a file describes.

    Args:
        path: An MJCF file (.xml, .mjcf) or a URDF file (.urdf).
        fingertips: Name of a site, geom or body for each of three to five fingertips.

    Raises:
        InputError: The file is refused; the message says what to do.
    """
    names = several(fingertips, partial(value_of, str, name="fingertips"), "fingertips", "names")
    place = path_of(path, "path")
    if place.suffix.lower() not in HAND_ENDINGS:
        raise InputError(
            f"path of a hand must end with {', '.join(HAND_ENDINGS)}, got {shown(str(path))}; "
            f"built-in hands are {', '.join(HANDS)}"
        )
    if not FEWEST_FINGERS <= len(names) <= MOST_FINGERS:
        raise InputError(
            f"{place}: name {FEWEST_FINGERS} to {MOST_FINGERS} fingertips (sites, geoms or bodies "
            f"of the file), got {len(names)}"
        )
    with about(place):
        return _read(place, tuple(names))


def _read(path: Path, fingertips: tuple[str, ...]) -> Hand:
    read = model_text(path)
    model = compiled_hand(read)
    found = finger_chains(model, fingertips)
    tips = [
        tip_of(model, tip, found.frames[chain[-1]])
        for tip, chain in zip(found.tips, found.joints, strict=True)
    ]
    covers = {tip.geom: cover for tip, (_, cover) in zip(found.tips, tips, strict=True)}
    shapes = _shapes(model, found, covers)
    rules, ranges, coupled = followers(model, found)
    fingers = [
        HandFinger(tip.name, _links(model, found, shapes, chain, ranges), made)
        for tip, chain, (made, _) in zip(found.tips, found.joints, tips, strict=True)
    ]
    own_fingers, couplings, originals = own_chains(fingers, rules)
    palm = tuple(shapes.get(-1, ()))
    hand = Hand(
        path.stem, palm, own_fingers, (f"{path.name}; {AS_BOXES}",),
        f"{path.name}; None where it states none",
        couplings=couplings,
        notes=(
            *read.notes, *model.notes, *coupled,
            *note("links without a mass weigh nothing", list(dict.fromkeys(
                link.name for finger in fingers for link in finger.links if link.mass_kg == 0.0
            ))),
            *note("links that fingers have in common", sorted(set(originals.values()))),
            *note("fingertips without shapes are the nearest shape of their link", [
                tip.name for tip in found.tips if tip.name not in
                (model.body_names[tip.body], *model.geom_names, *model.site_names)
            ]),
        ),
        palm_link=model.body_names[found.palm] or PALM_NAME,
        shared_motors=shared_motors(model, found),
    )  # fmt: skip
    middle = overlapping_pairs(hand, 0.5 * hand.ranges.sum(axis=1))
    pairs = _excluded(model, found) | (middle & _close_by(hand, originals))
    return replace(hand, ignored_pairs=tuple(sorted(pairs)))


def _named_pair(one: str, other: str) -> tuple[str, str]:
    """Return two names in the order in which a hand lists pairs of links."""
    return min(one, other), max(one, other)


def _close_by(hand: Hand, originals: dict[str, str]) -> set[tuple[str, str]]:
    """Return names of links at most two joints apart in a finger, or from the palm."""
    pairs = set[tuple[str, str]]()
    for finger in hand.fingers:
        chain = [PALM_NAME, *(originals.get(link.name, link.name) for link in finger.links)]
        for apart in range(1, CLOSE_BY + 1):
            pairs |= set(map(_named_pair, chain, chain[apart:]))
    return pairs


def _shapes(
    model: HandModel, found: FingerChains, covers: dict[int | None, LinkShape | None]
) -> dict[int, list[LinkShape]]:
    """Collect the shapes that collide, by the joint that moves them, in the links' frames."""
    shapes: dict[int, list[LinkShape]] = {}
    geoms = range(len(model.geom_kinds))
    for g in sorted(geoms, key=lambda g: covers.get(g) is not None):  # covers come last
        body = int(model.raw.geom_bodyid[g])
        owner = found.owners[body]
        if owner not in found.frames or model.geom_kinds[g] in {"plane", "hfield"}:
            continue
        if not (model.geom_bits[g].any() or g in covers):
            continue
        shape = covers.get(g) or _shape(model, g)
        turned, origin = found.frames[owner]
        R, p = model.rotations[body], model.positions[body]
        shapes.setdefault(owner, []).append(
            LinkShape(
                turned.T @ (p + R @ shape.position - origin),
                _squared(turned.T @ R @ shape.rotation),
                shape.half_sizes, shape.radius,
            )
        )  # fmt: skip
    return shapes


def _squared(R: Array) -> Array:
    """Return the rotation nearest to a matrix that is one but for rounding."""
    U, _, Vt = np.linalg.svd(R)
    return U @ Vt


def _shape(model: HandModel, g: int) -> LinkShape:
    kind, size, R = model.geom_kinds[g], model.raw.geom_size[g], _squared(model.geom_rotations[g])
    if kind in {"sphere", "capsule"}:
        half = np.array([0.0, 0.0, size[1] if kind == "capsule" else 0.0])
        return LinkShape(model.raw.geom_pos[g], R, half, float(size[0]))
    box = model.raw.geom_aabb[g]
    return LinkShape(model.raw.geom_pos[g] + R @ box[:3], R, box[3:], 0.0)


def _links(
    model: HandModel, found: FingerChains, shapes: dict[int, list[LinkShape]],
    chain: tuple[int, ...], ranges: Array,
) -> tuple[Link, ...]:  # fmt: skip
    links, before = list[Link](), -1
    for joint in chain:
        turned, origin = found.frames[joint]
        old, start = found.frames[before]
        mass, center = _mass(model, found, joint)
        place = old.T @ (origin - start), old.T @ turned
        moved = _joint(model, joint, *place, ranges[joint])
        own = tuple(shapes.get(joint, ()))
        links.append(Link(_link_name(model, joint), moved, own, mass, center))
        before = joint
    return tuple(links)


def _link_name(model: HandModel, joint: int) -> str:
    """Name a link: like its body, or like its joint where the body has several or no name."""
    if joint < 0:
        return PALM_NAME
    body = int(model.raw.jnt_bodyid[joint])
    shared = int((model.raw.jnt_bodyid == body).sum()) > 1
    name = model.joint_names[joint] if shared else model.body_names[body]
    return name if name and name != PALM_NAME else f"link{joint}"


def _joint(model: HandModel, joint: int, position: Array, rotation: Array, ends: Array) -> Joint:
    """Make a joint whose angle zero is the file's zero, not the pose in which the file draws it."""
    axis = model.raw.jnt_axis[joint] / np.linalg.norm(model.raw.jnt_axis[joint])
    low, high = np.where(np.isnan(ends), (-FULL_TURN, FULL_TURN), ends).tolist()
    # the frames are those at the reference angle; the same axis turns them to the angle zero
    back = rotation_about(axis, -float(model.references[joint]))
    torque = float(model.torques[joint])
    return Joint(
        joint_name(model, joint), position, _squared(rotation @ back),
        axis, low, high, None if np.isnan(torque) else torque,
    )  # fmt: skip


def _mass(model: HandModel, found: FingerChains, joint: int) -> tuple[float, Array]:
    """Sum the masses of the bodies that a joint moves, and find their middle in its frame."""
    bodies = [b for b, owner in enumerate(found.owners) if owner == joint]
    masses = model.raw.body_mass[bodies]
    masses = np.where(masses > NO_MASS_KG, masses, 0.0)
    total = float(masses.sum())
    if total == 0.0:
        return 0.0, np.zeros(3)
    places = model.positions[bodies] + np.einsum(
        "bij,bj->bi", model.rotations[bodies], model.raw.body_ipos[bodies]
    )
    turned, origin = found.frames[joint]
    return total, turned.T @ (masses @ places / total - origin)


def _excluded(model: HandModel, found: FingerChains) -> set[tuple[str, str]]:
    """Return the names of links that the file lets overlap."""
    pairs = [
        (found.owners[int(both) >> 16], found.owners[int(both) & 0xFFFF])
        for both in model.raw.exclude_signature.tolist()
    ]
    kept = [(one, other) for one, other in pairs if min(one, other) >= -1 and one != other]
    links = sorted({owner for owner in found.owners if owner >= -1})
    kept += [pair for pair in combinations(links, 2) if not _may_meet(model, found, *pair)]
    return {_named_pair(_link_name(model, one), _link_name(model, other)) for one, other in kept}


def _may_meet(model: HandModel, found: FingerChains, one: int, other: int) -> bool:
    bits = [
        model.geom_bits[[found.owners[b] == joint for b in model.raw.geom_bodyid.tolist()]]
        for joint in (one, other)
    ]
    first, second = bits[0][:, None], bits[1][None]
    return bool(((first[..., 0] & second[..., 1]) | (second[..., 0] & first[..., 1])).any())


def own_chains(
    fingers: Sequence[HandFinger], couplings: tuple[Coupling, ...]
) -> tuple[tuple[HandFinger, ...], tuple[Coupling, ...], dict[str, str]]:
    """Replace links that occur in several fingers by copies in all but the first of them.

    Gives also the couplings with those of the copies, and the link that each copy moves with.
    """
    leaders = {each.joint: each for each in couplings}
    seen, originals, kept = set[str](), dict[str, str](), list[HandFinger]()
    added = list[Coupling]()
    for finger in fingers:
        links = list[Link]()
        for link in finger.links:
            if link.name not in seen:
                links.append(link)
                continue
            name, joint = (name_of_copy(each, finger.name) for each in (link.name, link.joint.name))
            own = leaders.get(link.joint.name, Coupling(joint, link.joint.name, 1.0))
            added.append(replace(own, joint=joint))
            originals[name] = link.name
            links.append(Link(name, replace(link.joint, name=joint), (), 0.0, np.zeros(3)))
        seen |= {link.name for link in finger.links}
        kept.append(replace(finger, links=tuple(links)))
    return tuple(kept), (*couplings, *added), originals
