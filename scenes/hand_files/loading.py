"""Makes a hand of an MJCF or URDF file, of MuJoCo Menagerie's models, or of the built-in tables."""

import importlib
from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from grasp_core.arrays import Array
from grasp_core.checked import path_of, several, text
from grasp_core.errors import InputError
from grasp_core.hands.collisions import overlapping_pairs
from grasp_core.hands.couplings import Coupling
from grasp_core.hands.hand import (
    FEWEST_FINGERS,
    MOST_FINGERS,
    PALM,
    Fingertip,
    Hand,
    HandFinger,
    Joint,
    Link,
    LinkShape,
)
from grasp_core.hands.named_hands import HANDS
from grasp_core.hands.named_hands import load_hand as built_in_hand
from scenes.hand_files.model_text import model_text

if TYPE_CHECKING:
    from scenes.hand_files.chains import Chains
    from scenes.hand_files.couplings import Followers
    from scenes.hand_files.model import HandModel
    from scenes.hand_files.shared_links import OwnChains
    from scenes.hand_files.tips import TipBall

ENDINGS = (".xml", ".mjcf", ".urdf")
MENAGERIE = "menagerie:"
AS_BOXES = "shapes other than boxes, capsules and spheres are taken as their boxes"
CLOSE_BY = 2
"""Number of joints between links that may be built into each other, at most."""
FULL_TURN = np.pi
"""Largest angle of a joint for which the file states no range [rad]."""


def load_hand(hand: str | Path, fingertips: Iterable[str] = ()) -> Hand:
    """Load a hand by name or from a file.

    Args:
        hand: "allegro", "allegro-urdf" or "leap"; the path of an MJCF file (.xml, .mjcf) or a URDF
            file (.urdf); or "menagerie:NAME" for a model of the package `mujoco-menagerie`.
        fingertips: For a file, the name of a site, geom or body for each of three to five
            fingertips. A built-in hand has its own.

    Raises:
        InputError: The hand is unknown, or the file is refused; the message says what to do.
    """
    names = several(fingertips, partial(text, name="fingertips"), "fingertips", "names")
    if isinstance(hand, str) and hand in HANDS:
        if names:
            raise InputError(f"the built-in hand {hand} has its own fingertips; leave them out")
        return built_in_hand(hand)
    if isinstance(hand, str) and hand.startswith(MENAGERIE):
        path = importlib.import_module("scenes.hand_files.menagerie").model_path(
            hand[len(MENAGERIE) :]
        )
    else:
        path = path_of(hand, "hand")
    if path.suffix.lower() not in ENDINGS:
        raise InputError(
            f"hand must be {', '.join(HANDS)}, {MENAGERIE}NAME, or a file that ends with "
            f"{', '.join(ENDINGS)}, got {str(hand)[:80]!r}"
        )
    if not FEWEST_FINGERS <= len(names) <= MOST_FINGERS:
        raise InputError(
            f"{path}: name {FEWEST_FINGERS} to {MOST_FINGERS} fingertips (sites, geoms or bodies "
            f"of the file), got {len(names)}"
        )
    return _from_file(path, names)


def _from_file(path: Path, fingertips: tuple[str, ...]) -> Hand:
    model_module: Any = importlib.import_module("scenes.hand_files.model")
    chain_module: Any = importlib.import_module("scenes.hand_files.chains")
    read = model_text(path)
    model: HandModel = model_module.compiled_hand(read, str(path))
    found: Chains = chain_module.chains(model, fingertips, str(path))
    frames: dict[int, tuple[Array, Array]] = chain_module.frames(model, found)
    balls = _balls(model, found, frames, str(path))
    shapes = _shapes(model, found, frames, balls)
    coupled: Followers = importlib.import_module("scenes.hand_files.couplings").followers(
        model, found, str(path)
    )
    fingers = [
        HandFinger(tip.name, _links(model, found, frames, shapes, chain, coupled.ranges), ball)
        for tip, chain, (ball, _) in zip(found.tips, found.joints, balls, strict=True)
    ]
    own: OwnChains = importlib.import_module("scenes.hand_files.shared_links").own_chains(
        fingers, _couplings(model, coupled)
    )
    palm = tuple(shapes.get(-1, ()))
    hand = Hand(
        path.stem, palm, own.fingers, (f"{path.name}; {AS_BOXES}",),
        f"{path.name}; None where it states none",
        couplings=own.couplings,
        notes=(
            *read.notes, *model.notes, *coupled.notes, *own.notes, *_tips_elsewhere(model, found)
        ),
    )  # fmt: skip
    middle = overlapping_pairs(hand, 0.5 * hand.ranges.sum(axis=1))
    pairs = _excluded(model, found) | (middle & _close_by(hand, own.originals))
    return replace(hand, ignored_pairs=tuple(sorted(pairs)))


def _tips_elsewhere(model: "HandModel", found: "Chains") -> tuple[str, ...]:
    """Say which fingertips are bodies without shapes of their own."""
    names = [
        tip.name for tip in found.tips
        if tip.name not in (model.body_names[tip.body], *model.geom_names, *model.site_names)
    ]  # fmt: skip
    if not names:
        return ()
    return (f"fingertips without shapes are the nearest shape of their link: {', '.join(names)}",)


def _couplings(model: "HandModel", coupled: "Followers") -> tuple[Coupling, ...]:
    return tuple(
        Coupling(_joint_name(model, joint), _joint_name(model, line.root), line.ratio, line.offset)
        for joint, line in sorted(coupled.lines.items())
    )


def _close_by(hand: Hand, originals: dict[str, str]) -> set[tuple[str, str]]:
    """Return the names of links that overlap where they are built into each other.

    They are two joints apart at most, in one finger or from the palm. Links of different fingers
    that meet in the middle of their ranges are not: fingers that close meet there.
    """
    pairs = set[tuple[str, str]]()
    for finger in hand.fingers:
        chain = [PALM, *(originals.get(link.name, link.name) for link in finger.links)]
        for apart in range(1, CLOSE_BY + 1):
            pairs |= {(min(p), max(p)) for p in zip(chain, chain[apart:], strict=False)}
    return pairs


def _balls(
    model: "HandModel", found: "Chains", frames: dict[int, tuple[Array, Array]], name: str
) -> list[tuple[Fingertip, "TipBall"]]:
    """Find the fingertips' balls, in the frames of the last links."""
    tips: Any = importlib.import_module("scenes.hand_files.tips")
    balls = list[tuple[Fingertip, "TipBall"]]()
    for tip, chain in zip(found.tips, found.joints, strict=True):
        R, p = model.rotations[tip.body], model.positions[tip.body]
        turned, origin = frames[chain[-1]]
        ball: TipBall = tips.tip_ball(model, tip, R.T @ (origin - p), name)
        center = turned.T @ (p + R @ ball.center - origin)
        corners = None if ball.corners is None else (p + ball.corners @ R.T - origin) @ turned
        balls.append((Fingertip(center, ball.radius, corners, ball.rounding), ball))
    return balls


def _shapes(
    model: "HandModel", found: "Chains", frames: dict[int, tuple[Array, Array]],
    balls: list[tuple[Fingertip, "TipBall"]],
) -> dict[int, list[LinkShape]]:  # fmt: skip
    """Collect the shapes that collide, by the joint that moves them, in the links' frames."""
    covers = {
        tip.geom: ball.cover
        for tip, (_, ball) in zip(found.tips, balls, strict=True)
        if tip.geom is not None and ball.cover is not None
    }
    shapes: dict[int, list[LinkShape]] = {}
    for g in sorted(range(len(model.geom_kinds)), key=covers.__contains__):  # covers come last
        body = int(model.geom_bodies[g])
        owner, kind = found.owners[body], model.geom_kinds[g]
        named = any(tip.geom == g for tip in found.tips)
        if owner not in frames or kind in {"plane", "hfield"}:
            continue
        if not (model.geom_bits[g].any() or named):
            continue
        shape = covers.get(g) or _shape(model, g)
        turned, origin = frames[owner]
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


def _shape(model: "HandModel", g: int) -> LinkShape:
    """Return a geom's shape in the frame of its body."""
    kind, size, R = model.geom_kinds[g], model.geom_sizes[g], _squared(model.geom_rotations[g])
    if kind in {"sphere", "capsule"}:
        half = np.array([0.0, 0.0, size[1] if kind == "capsule" else 0.0])
        return LinkShape(model.geom_positions[g], R, half, float(size[0]))
    box = model.geom_boxes[g]
    return LinkShape(model.geom_positions[g] + R @ box[:3], R, box[3:], 0.0)


def _links(
    model: "HandModel", found: "Chains", frames: dict[int, tuple[Array, Array]],
    shapes: dict[int, list[LinkShape]], chain: tuple[int, ...],
    ranges: dict[int, tuple[float, float]],
) -> tuple[Link, ...]:  # fmt: skip
    """Make the links of a finger."""
    links, before = list[Link](), -1
    for joint in chain:
        turned, origin = frames[joint]
        old, start = frames[before]
        mass, center = _mass(model, found, joint, turned, origin)
        low, high = model.joint_ranges[joint].tolist()
        ends = ranges.get(joint, (low, high))
        links.append(
            Link(
                _link_name(model, joint),
                _joint(model, joint, old.T @ (origin - start), old.T @ turned, ends),
                tuple(shapes.get(joint, ())),
                mass,
                center,
            )
        )
        before = joint
    return tuple(links)


def _link_name(model: "HandModel", joint: int) -> str:
    """Name a link: like its body, or like its joint where the body has several or no name."""
    body = int(model.joint_bodies[joint])
    shared = int((model.joint_bodies == body).sum()) > 1
    name = model.joint_names[joint] if shared else model.body_names[body]
    return name if name and name != PALM else f"link{joint}"


def _joint_name(model: "HandModel", joint: int) -> str:
    return model.joint_names[joint] or f"joint{joint}"


def _joint(
    model: "HandModel",
    joint: int,
    position: Array,
    rotation: Array,
    ends: tuple[float, float],
) -> Joint:
    """Make a joint whose angle zero is the file's zero, not the pose in which the file draws it."""
    axis = model.joint_axes[joint]
    low, high = np.where(np.isnan(ends), (-FULL_TURN, FULL_TURN), ends).tolist()
    # the frames are those at the reference angle; the same axis turns them to the angle zero
    back = _turn(axis, -float(model.references[joint]))
    torque = float(model.torques[joint])
    return Joint(
        _joint_name(model, joint), position, _squared(rotation @ back),
        axis / np.linalg.norm(axis), low, high, None if np.isnan(torque) else torque,
    )  # fmt: skip


def _turn(axis: Array, angle: float) -> Array:
    """Return the rotation about a unit axis by Rodrigues' formula, (3, 3)."""
    x, y, z = axis / np.linalg.norm(axis)
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * K @ K


def _mass(
    model: "HandModel", found: "Chains", joint: int, turned: Array, origin: Array
) -> tuple[float, Array]:
    """Sum the masses of the bodies that a joint moves, and find their middle in its frame."""
    bodies = [b for b, owner in enumerate(found.owners) if owner == joint]
    masses = model.masses[bodies]
    total = float(masses.sum())
    if total == 0.0:
        return 0.0, np.zeros(3)
    places = model.positions[bodies] + np.einsum(
        "bij,bj->bi", model.rotations[bodies], model.mass_centers[bodies]
    )
    return total, turned.T @ (masses @ places / total - origin)


def _excluded(model: "HandModel", found: "Chains") -> set[tuple[str, str]]:
    """Return the names of links that the file lets overlap."""
    pairs = set[tuple[str, str]]()
    for one, other in model.excluded.tolist():
        owners = found.owners[int(one)], found.owners[int(other)]
        if min(owners) >= -1 and owners[0] != owners[1]:
            named = [PALM if j < 0 else _link_name(model, j) for j in owners]
            pairs.add((min(named), max(named)))
    links = sorted({owner for owner in found.owners if owner >= -1})
    for one, other in combinations(links, 2):
        if not _may_meet(model, found, one, other):
            named = [PALM if j < 0 else _link_name(model, j) for j in (one, other)]
            pairs.add((min(named), max(named)))
    return pairs


def _may_meet(model: "HandModel", found: "Chains", one: int, other: int) -> bool:
    """Return whether the bits of any two geoms of two links let them collide."""
    bits = [
        model.geom_bits[[found.owners[b] == joint for b in model.geom_bodies.tolist()]]
        for joint in (one, other)
    ]
    first, second = bits[0][:, None], bits[1][None]
    return bool(((first[..., 0] & second[..., 1]) | (second[..., 0] & first[..., 1])).any())
