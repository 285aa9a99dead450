"""Decides by winding numbers which side of a surface is inside, and winds triangles alike.

The winding number of a point is the sum of the solid angles of all triangles as seen from it,
divided by that of the whole sphere. It is one inside a closed surface that is wound
counter-clockwise seen from outside, and zero outside. It jumps by one across each triangle, so on a
triangle the mean of both sides, in which the triangle itself does not count, is

    1/2   where the triangle bounds the solid,
    -1/2  where it does so inside out,
    3/2   where it is inside another part of the solid.

Holes change these values by the share of the sphere that they fill, seen from the triangle. A
triangle of an open surface is certain to be outward if it bounds the solid by this rule, as far as
holes allow. Where so much of the surface is missing that the sign of the mean winding number could
come from the shape of the hole, as with one half of a ball, nothing is certain.

Sources: Van Oosterom and Strackee, "The solid angle of a plane triangle", 1983; Jacobson, Kavan and
Sorkine-Hornung, "Robust inside-outside segmentation using generalized winding numbers", 2013.
"""

import math

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices
from grasp_core.errors import MeshError, MeshRefusal
from grasp_core.objects.shells import SMALL, left_out
from grasp_core.objects.surface import SoundSurface
from grasp_core.objects.triangles import NO_CAPS, Edges, Mesh, components, numbered

CERTAIN = 0.4
"""Least mean winding number on an open surface that is taken for outward: half a ball has 0.3."""
NEAR = 0.25
"""Largest distance from 1/2 of the winding number on a part that bounds the solid."""


def check_bounds(surface: Mesh) -> None:
    """Refuse a closed surface if more than next to nothing of it does not bound the solid."""
    winding = winding_on(surface.corners, sampled(surface.areas))
    off = float((np.abs(winding - 0.5) > NEAR).mean())
    if off > SMALL:
        raise _crossing(off)


def outward_sheets(found: SoundSurface, *, largest_part: bool) -> SoundSurface:
    """Orient the parts of an open surface outwards."""
    # parts connect across edges of two triangles
    here, side = np.nonzero(found.across >= 0)
    links = np.column_stack([here, found.across[here, side]])
    label, said = numbered(len(found.triangles), links), list[str]()
    mesh, whole, count = Mesh(found.vertices, found.triangles), found.areas.sum(), label.max() + 1
    if largest_part:
        kept = label == np.bincount(label, weights=mesh.areas).argmax()
        mesh = Mesh(mesh.vertices, mesh.triangles[kept])
        label = np.zeros(len(mesh.triangles), np.int64)
    sizes = np.bincount(label, weights=mesh.areas)
    winding = _winding_of_parts(mesh, label)
    turn = winding * (1.0 if sizes @ winding > 0.0 else -1.0) < -NEAR
    turn ^= bool(sizes @ winding < 0.0)
    if turn.any():
        turned = np.where(turn[label][:, None], mesh.triangles[:, ::-1], mesh.triangles)
        mesh = Mesh(mesh.vertices, turned)
        winding = _winding_of_parts(mesh, label)
        said.append(f"{int(turn.sum())} of {len(sizes)} parts of the open surface were inside out; "
                    "their triangles were turned")  # fmt: skip
    sound = np.abs(winding - 0.5) <= NEAR
    mean = float(sizes @ winding / sizes.sum())
    unsound = float(sizes[~sound].sum()) / whole
    if unsound > SMALL and mean > CERTAIN:
        raise _crossing(unsound)
    if unsound > SMALL or not mean >= CERTAIN:
        raise MeshError(
            MeshRefusal.OPEN,
            "the surface is open, and it is not certain which side is inside: the mean winding "
            f"number on it is {mean:.2f}, expected 0.5 but for what holes are missing, at least "
            f"{CERTAIN}; close the surface, or leave out all but its largest part (--largest-part)",
        )
    dropped = unsound + 1.0 - float(sizes.sum()) / whole if largest_part else unsound
    if (apart := int(count - sound.sum())) > 0:
        said.append(left_out(apart, dropped))
    used = mesh.with_triangles(mesh.triangles[sound[label]])
    return found.mended(used, NO_CAPS, max(dropped, 0.0), said)


def _winding_of_parts(mesh: Mesh, label: Indices) -> Array:
    """Average the winding number over samples of each part, (parts,); 0 for parts not looked at."""
    places = sampled(mesh.areas)
    _, first = np.unique(label, return_index=True)
    unseen = first[~np.isin(np.arange(len(first)), label[places])]
    places = np.concatenate([places, unseen[: MOST_ANGLES // len(mesh.triangles)]])
    found = winding_on(mesh.corners, places)
    sums, counts = (
        np.bincount(label[places], weights=weight, minlength=len(first))
        for weight in (found, np.ones(len(places)))
    )
    return sums / np.maximum(counts, 1.0)


def _crossing(share: float) -> MeshError:
    return MeshError(
        MeshRefusal.OVERLAP,
        f"{100.0 * share:.2g} % of the surface is inside other parts of it, or bounds nothing; "
        "unite the parts and repair the surface in a modelling program, or leave out all parts but "
        "the largest (--largest-part)",
    )


MOST_ANGLES = 2_000_000
"""Largest number of solid angles that are computed for one mesh."""
FEWEST_SAMPLES, MOST_SAMPLES = 32, 256
BLOCK = 20_000
"""Number of solid angles computed at a time, which stays in the processor's cache."""


def sampled(areas: Array) -> Indices:
    """Choose triangles that stand for equal shares of a surface each, (s,)."""
    count = min(max(MOST_ANGLES // len(areas), FEWEST_SAMPLES), MOST_SAMPLES, len(areas))
    upto: Array = np.cumsum(areas)
    middles = np.linspace(0.0, float(upto[-1]), 2 * count + 1)[1::2]
    return np.minimum(np.searchsorted(upto, middles), len(areas) - 1)


def winding_on(corners: Array, places: Indices) -> Array:
    """Compute the mean winding number of both sides of triangles, at their middles, (s,)."""
    found = np.zeros(len(places))
    step = max(BLOCK // len(corners), 1)
    axes = np.ascontiguousarray(corners.transpose(2, 1, 0))
    for start in range(0, len(places), step):
        asked = places[start : start + step]
        angles = solid_angles(axes, corners[asked].mean(axis=1))
        angles[np.arange(len(asked)), asked] = 0.0
        found[start : start + step] = angles.sum(axis=1) / (4.0 * math.pi)
    return found


def solid_angles(axes: Array, points: Array) -> Array:
    """Return solid angles of triangles seen from points, signed (Van Oosterom & Strackee 1983).

    Triangles are given by coordinates, corners and number, (3, 3, t); found are (points, t).
    """
    x, y, z = (axes[k] - points[:, k, None, None] for k in range(3))
    lengths = np.sqrt(x * x + y * y + z * z)
    (ax, bx, cx), (ay, by, cy), (az, bz, cz), (a, b, c) = (
        each.transpose(1, 0, 2) for each in (x, y, z, lengths)
    )
    volume = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    spread = (
        a * b * c
        + (ax * bx + ay * by + az * bz) * c
        + (bx * cx + by * cy + bz * cz) * a
        + (cx * ax + cy * ay + cz * az) * b
    )
    return 2.0 * np.arctan2(volume, spread)


def wound_alike(corners: Indices, areas: Array) -> tuple[Indices, NDArray[np.bool_]] | None:
    """Wind triangles like their neighbours; None if the surface has only one side.

    In each part that connects across edges of two triangles, the larger area keeps its winding.
    Gives the triangles, and which of them were turned.
    """
    edges = Edges.of(corners)
    across, against = edges.neighbours(), edges.against[edges.place].reshape(-1, 3)
    # each triangle counts twice, as it is and turned; those that are wound alike are linked
    inner, count = across >= 0, len(corners)
    here, there, flip = np.nonzero(inner)[0], across[inner], count * against[inner]
    links = np.column_stack([here, there + flip, here + count, there + count - flip])
    one, other = components(2 * count, links.reshape(-1, 2)).reshape(2, count)
    if (one == other).any():
        return None
    # the first triangle of each part stands as it is
    turned, part = other < one, np.minimum(one, other)
    size, swept = (
        np.bincount(part, weights=weight, minlength=len(corners))
        for weight in (areas, areas * turned)
    )
    turned ^= (swept > 0.5 * size)[part]
    return np.where(turned[:, None], corners[:, ::-1], corners), turned
