"""Orients the parts of an open surface outwards by winding numbers, or refuses it.

A triangle is certain to be outward if it bounds the solid by the rule of `winding`, as far as holes
allow. Where so much of the surface is missing that the sign of the mean winding number could come
from the shape of the hole, as with one half of a ball, nothing is certain.
"""

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.errors import MeshError, MeshRefusal
from grasp_core.geometry.connectivity import components
from grasp_core.objects.planar_faces import SIDES, triangle_neighbours
from grasp_core.objects.shells import SMALL, Shells, left_out
from grasp_core.objects.solid_checks import triangle_areas
from grasp_core.objects.winding import MOST_ANGLES, sampled, winding_on

CERTAIN = 0.4
"""Least mean winding number on an open surface that is taken for outward: half a ball has 0.3."""
NEAR = 0.25
"""Largest distance from 1/2 of the winding number on a part that bounds the solid."""


def check_bounds(points: Array, corners: Indices) -> None:
    """Refuse a closed surface if more than next to nothing of it does not bound the solid."""
    places = sampled(triangle_areas(points, corners))
    off = float((np.abs(winding_on(points[corners], places) - 0.5) > NEAR).mean())
    if off > SMALL:
        raise _crossing(off)


def outward_sheets(points: Array, corners: Indices, *, largest_part: bool) -> Shells:
    """Orient the parts of an open surface outwards.

    Takes `points` (n, 3) [m]; `corners` (t, 3).
    """
    areas, label, said = triangle_areas(points, corners), _labels(corners), list[str]()
    whole, count = float(areas.sum()), int(label.max()) + 1
    if largest_part:
        kept = label == np.bincount(label, weights=areas).argmax()
        corners, areas, label = corners[kept], areas[kept], np.zeros(int(kept.sum()), np.int64)
    sizes = np.bincount(label, weights=areas)
    winding = _winding_of_parts(points, corners, areas, label)
    turn = winding * (1.0 if sizes @ winding > 0.0 else -1.0) < -NEAR
    turn ^= bool(sizes @ winding < 0.0)
    if turn.any():
        corners = np.where(turn[label][:, None], corners[:, ::-1], corners)
        winding = _winding_of_parts(points, corners, areas, label)
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
    corners = corners[sound[label]]
    dropped = unsound + 1.0 - float(sizes.sum()) / whole if largest_part else unsound
    if (apart := count - int(sound.sum())) > 0:
        said.append(left_out(apart, dropped))
    used, local = np.unique(corners, return_inverse=True)
    none = np.empty(0, dtype=np.int64)
    return Shells(points[used], local.reshape(-1, 3), none, max(dropped, 0.0), tuple(said))


def _winding_of_parts(points: Array, corners: Indices, areas: Array, label: Indices) -> Array:
    """Average the winding number over samples of each part, (parts,).

    Parts that are too small and too many to be looked at count as lying on no solid.
    """
    places = sampled(areas)
    _, first = np.unique(label, return_index=True)
    unseen = first[~np.isin(np.arange(len(first)), label[places])]
    places = np.concatenate([places, unseen[: MOST_ANGLES // len(corners)]])
    found = winding_on(points[corners], places)
    sums, counts = (
        np.bincount(label[places], weights=weight, minlength=len(first))
        for weight in (found, np.ones(len(places)))
    )
    return sums / np.maximum(counts, 1.0)


def _labels(corners: Indices) -> Indices:
    """Number the part of each triangle; parts connect across edges of two triangles, (t,)."""
    across = triangle_neighbours(corners)
    here = np.repeat(np.arange(len(corners)), SIDES + 1)
    links = np.column_stack([here, across.ravel()])[across.ravel() >= 0]
    _, label = np.unique(components(len(corners), links), return_inverse=True)
    return label


def _crossing(share: float) -> MeshError:
    return MeshError(
        MeshRefusal.OVERLAP,
        f"{100.0 * share:.2g} % of the surface is inside other parts of it, or bounds nothing; "
        "unite the parts and repair the surface in a modelling program, or leave out all parts but "
        "the largest (--largest-part)",
    )
