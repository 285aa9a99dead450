"""Decides which side of a surface is inside, and makes one solid of the closed shells of a mesh.

A shell is a part of the mesh that connects across edges. A shell that encloses a positive volume is
a body; one of negative volume is a cavity if a body encloses it, and a body that is inside out if
it is beside all others. Bodies that overlap are united, and those that touch (see
`touching_parts`). A body inside the material of another cannot be told from a cavity that is wound
like the outside, so it is refused, as are bodies apart from each other. Parts that would be refused
are left out if all of them together have next to no area, or if the user asks for the largest part
alone.

Of open surfaces, winding numbers decide it. The winding number of a point is the sum of the solid
angles of all triangles as seen from it, divided by that of the whole sphere. It is one inside a
closed surface that is wound counter-clockwise seen from outside, and zero outside. It jumps by one
across each triangle, so on a triangle the mean of both sides, in which the triangle itself does not
count, is

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
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from grasp_core.arrays import Array, Indices
from grasp_core.errors import InputError, MeshError, MeshRefusal
from grasp_core.mesh_files.limits import MeshChoices
from grasp_core.objects.booleans import Solid, gap_between, intersection_volume, union
from grasp_core.objects.planar_faces import PLANAR, planar_slack
from grasp_core.objects.surface import (
    NO_CAPS,
    Mesh,
    MeshEdges,
    SoundSurface,
    components,
    crosses_of,
)
from grasp_core.objects.touching_parts import pressed_together, widest_gap

OVERLAP_SHARE = 1e-6
"""Volume shared by two parts, over the whole, above which they overlap and not only touch."""
SMALL_SHARE = 0.01
"""Largest share of the surface that is left out without being asked for."""
TOUCHING_SHARE = 0.5
"""Largest distance of faces that touch, over that within which corners count as in one plane."""
PRESSED = 0.25
"""Depth to which touching faces are pressed into each other, over the same distance."""
NEARLY = 1e-3
"""Largest gap between solids that are nearly one, over the extent."""
CLEAN = 1e-4
"""Largest share of a union's surface beside slits as thin as rounding; sound ones show 1e-6."""
LEAST_VOLUME = 1e-9
"""Least volume of a solid, relative to the cube of the extent."""
SLIT_WIDTH = 4e-6
"""Width of a slit, relative to the extent, which rounding in single precision may leave."""


@dataclass(frozen=True, eq=False)
class _Body(Solid):
    """A body with its cavities."""

    marks: Indices  # numbers of the triangles in the mesh, (t,)

    @property
    def area(self) -> float:
        return float(self.areas.sum())

    def joined(self, other: "_Body") -> "_Body":
        return _Body(
            np.concatenate([self.vertices, other.vertices]),
            np.concatenate([self.triangles, other.triangles + len(self.vertices)]),
            np.concatenate([self.marks, other.marks]),
        )

    def turned(self) -> "_Body":
        return _Body(self.vertices, self.triangles[:, ::-1], self.marks)

    def parts(self) -> "list[_Body]":
        """Split the body into parts that share no edge."""
        label, parts = self.edges.parts(), list[_Body]()
        for part in range(int(label.max()) + 1):
            mine = label == part
            used = self.with_triangles(self.triangles[mine])
            parts.append(_Body(used.vertices, used.triangles, self.marks[mine]))
        return parts


def one_solid(found: SoundSurface, choices: MeshChoices) -> SoundSurface:
    """Orient the shells of a closed surface outwards, and make one solid of them."""
    triangles, said = found.triangles, list[str]()
    check_volume(found)
    if found.volume < 0.0:
        triangles = triangles[:, ::-1]
        said.append("the mesh was inside out; its triangles were turned")
    whole = _Body(found.vertices, triangles, np.arange(len(triangles)))
    shells = whole.parts()
    if (count := len(shells)) > (most := choices.max_parts):
        raise MeshError(
            MeshRefusal.SEPARATE,
            f"the mesh has {count} parts, more than the limit of {most}; give one solid, or allow "
            "more (--max-parts)",
        )
    as_it_is = found.mended(whole, found.surface.caps, 0.0, said)
    if count == 1:
        return as_it_is
    try:
        kept, dropped, changed = _of_many(shells, found, largest_part=choices.largest_part)
    except InputError as error:
        if isinstance(error, MeshError):
            raise
        raise MeshError(MeshRefusal.NON_MANIFOLD, f"parts cannot be compared: {error}") from error
    if not changed:
        return as_it_is
    is_cap = np.flatnonzero(np.isin(kept.marks, found.surface.caps))
    used = kept.with_triangles(kept.triangles)
    return found.mended(used, is_cap, dropped, [*said, *changed])


def _of_many(
    shells: list[_Body], found: SoundSurface, *, largest_part: bool
) -> tuple[_Body, float, list[str]]:
    """Return the one body to use, the share of the area left out, and what else was changed."""
    said = list[str]()
    area = sum(shell.area for shell in shells)
    slack = OVERLAP_SHARE * abs(found.volume)
    bodies, bad, why = _sorted_out(shells, slack, said)
    if not bodies and why is not None:
        raise why
    united = _united(bodies, found, said)
    kept = max(united, key=lambda body: body.area)
    apart = [body for body in united if body is not kept]
    if apart and why is None:
        why = MeshError(
            MeshRefusal.SEPARATE,
            f"the mesh holds {len(united)} solids, expected one solid; "
            f"{_on_gaps(united, found.extent) or _on_edges(united, found.extent)}give each its own "
            "file, or use the largest alone (--largest-part)",
        )
    dropped = sum(body.area for body in (*apart, *bad)) / area
    if why is not None and dropped > SMALL_SHARE and not largest_part:
        raise why
    if apart or bad:
        said.append(left_out(len(apart) + len(bad), dropped))
    return kept, dropped, said


def left_out(count: int, share: float) -> str:
    """Say that parts with a share of the surface are not used."""
    return f"{count} part{'s' * (count > 1)} with {100.0 * share:.3g} % of the surface left out"


def _sorted_out(
    shells: list[_Body], slack: float, said: list[str]
) -> tuple[list[_Body], list[_Body], MeshError | None]:
    """Give each cavity to its body; return bodies, parts that cannot be used, and the reason."""
    flat = [s for s in shells if abs(s.volume) <= LEAST_VOLUME * s.extent**3]
    bodies = [s for s in shells if s not in flat and s.volume > 0.0]
    bad: list[_Body] = flat
    why: MeshError | None = None
    if flat:
        why = MeshError(
            MeshRefusal.ZERO_VOLUME,
            f"parts that enclose almost no volume: {len(flat)}; delete them, or close them around "
            "solids",
        )
    for shell in shells:
        if shell.volume > 0.0 or shell in flat:
            continue
        hollow = shell.turned()
        shared = [intersection_volume(body, hollow) for body in bodies]
        around = [k for k, part in enumerate(shared) if part >= hollow.volume - slack]
        if around:
            host = min(around, key=lambda k: bodies[k].volume)
            bodies[host] = bodies[host].joined(shell)
        elif sum(shared) <= slack:
            bodies.append(hollow)
            said.append("a part that was inside out was turned")
        else:
            bad = [*bad, hollow]
            why = MeshError(
                MeshRefusal.WINDING,
                "one part is inside out and not a cavity of another; wind its triangles "
                "counter-clockwise seen from outside",
            )
    inner = [body for k, body in enumerate(bodies) if _is_inside_another(k, bodies, slack)]
    if inner:
        why = MeshError(
            MeshRefusal.OVERLAP,
            f"closed parts inside the material of another, wound like it: {len(inner)}; turn the "
            "triangles of those that are cavities, and delete the others or unite them with the "
            "rest, or use the largest part alone (--largest-part)",
        )
    outer = [body for body in bodies if body not in inner]
    return outer, [*bad, *inner], why


def _is_inside_another(place: int, bodies: list[_Body], slack: float) -> bool:
    """Tell whether a larger body, or an equal one before it, holds a body in its material."""
    inner = bodies[place]
    low, high = inner.vertices.min(axis=0), inner.vertices.max(axis=0)
    return any(
        (other.volume, place) > (inner.volume, k)
        and bool((other.vertices.min(axis=0) <= high).all())
        and bool((low <= other.vertices.max(axis=0)).all())
        and intersection_volume(other, inner) >= inner.volume - slack
        for k, other in enumerate(bodies)
    )


def _united(bodies: list[_Body], found: SoundSurface, said: list[str]) -> list[_Body]:
    """Unite bodies that overlap or touch; those that do not are returned as they are."""
    if len(bodies) == 1:
        return bodies
    extent, slack = found.extent, OVERLAP_SHARE * abs(found.volume)
    reach = TOUCHING_SHARE * planar_slack(extent, found.surface.flatness_m)
    united, pairs = _union(bodies, slack), list[tuple[int, int]]()
    # exact faces unite as they are; those that are off by rounding need to overlap
    if len(united) > 1 or reach > SLIT_WIDTH * extent or _slitted(united):
        places, pairs = pressed_together(bodies, max(SLIT_WIDTH * extent, reach), PRESSED * reach)
        pressed = [replace(each, vertices=at) for each, at in zip(bodies, places, strict=True)]
        groups = _joined_by(pairs, bodies, united)
        united = _union(pressed, slack) if pairs else united
        if len(united) < groups:  # by what faces move, parts overlap that only an edge connects
            return bodies
    if len(united) == len(bodies):
        return bodies
    if pairs and _slitted(united):  # else what is thin is where surfaces cross
        raise MeshError(
            MeshRefusal.OVERLAP,
            f"parts touch, but rounding leaves thin slits between them; {_on_gaps(bodies, extent)}"
            "let them overlap, or unite them in a modelling program",
        )
    said.append(f"{len(bodies)} parts that overlap or touch were united")
    return united


def _union(bodies: list[_Body], slack: float) -> list[_Body]:
    solid, marks = union(bodies, [body.marks for body in bodies])
    parts = _Body(solid.vertices, solid.triangles, marks).parts()
    united, flat, _ = _sorted_out(parts, slack, [])
    return united + [shell for shell in flat if shell.volume > 0.0]


def _joined_by(pairs: list[tuple[int, int]], bodies: list[_Body], united: list[_Body]) -> int:
    marks = [frozenset(body.marks.tolist()) for body in bodies]
    for solid in united:
        first, *others = [k for k, own in enumerate(marks) if not own.isdisjoint(solid.marks)]
        pairs = [*pairs, *((first, other) for other in others)]
    return len(set(components(len(bodies), np.array(pairs, dtype=np.int64).reshape(-1, 2))))


def _slitted(bodies: list[_Body]) -> bool:
    return max(map(thin_share, bodies)) > CLEAN


def _on_gaps(bodies: list[_Body], extent: float) -> str:
    """Say what helps bodies with gaps between their faces, if there are any."""
    gap = widest_gap(bodies, NEARLY * extent)
    if gap is None or gap <= PLANAR * extent:
        return ""
    return (
        f"take faces that are up to {1e3 * gap:.2g} mm apart for touching (--flatness-m "
        f"{1.1 * gap / TOUCHING_SHARE:.1e}), or "
    )


def _on_edges(bodies: list[_Body], extent: float) -> str:
    """Say so if bodies meet in no more than edges or corners."""
    near = PLANAR * extent
    if any(gap_between(one, two, 2.0 * near) <= near for one, two in combinations(bodies, 2)):
        return "some meet in edges or corners only, which hold nothing: let them overlap, or "
    return ""


def check_volume(solid: Mesh) -> None:
    """Refuse a solid that encloses almost no volume."""
    if abs(solid.volume) < LEAST_VOLUME * solid.extent**3:
        message = f"the mesh encloses only {solid.volume:.3g} m^3; close it around a solid"
        raise MeshError(MeshRefusal.ZERO_VOLUME, message)


def keep_out_of_voids(found: SoundSurface) -> SoundSurface:
    """Let no finger stand on the walls of voids, which are closed parts wound inwards."""
    label, sizes = found.connected, np.linalg.det(found.corners - found.vertices.mean(axis=0))
    volumes = np.bincount(label, weights=sizes) / 6.0
    is_open = np.bincount(label, weights=(found.across < 0).any(axis=1)) > 0.0
    is_void = ~is_open & (volumes < -LEAST_VOLUME * found.extent**3)
    if not is_void.any():
        return found
    count, volume = int(is_void.sum()), -1e6 * float(volumes[is_void].sum())
    said = (
        f"{count} void{'s' * (count > 1)} of {volume:.4g} cm^3 sealed from the outside: no finger "
        "is placed inside, and volume and centre of mass are without it"
    )
    walls = np.flatnonzero(is_void[label])
    return found.mended(found, np.union1d(found.surface.caps, walls), 0.0, [said])


def thin_share(solid: Solid) -> float:
    """Return the share of the surface that is beside slits or walls thinner than `SLIT_WIDTH`.

    Solved: a solid that is moved by a step along an axis leaves a volume of the step times the area
    that it shows along the axis, each wall counted, less what slits and walls thinner than the step
    hide. The largest share of the three axes is returned.
    """
    step = SLIT_WIDTH * solid.extent
    seen = 0.25 * np.abs(crosses_of(solid.corners)).sum(axis=0)
    left = [
        solid.volume - intersection_volume(solid, solid.moved(step * axis)) for axis in np.eye(3)
    ]
    return float(np.abs(seen - np.array(left) / step).max() / seen.max())


CERTAIN = 0.4
"""Least mean winding number on an open surface that is taken for outward: half a ball has 0.3."""
NEAR_HALF = 0.25
"""Largest distance from 1/2 of the winding number on a part that bounds the solid."""


def check_bounds(surface: Mesh) -> None:
    """Refuse a closed surface if more than next to nothing of it does not bound the solid."""
    winding = winding_on(surface.corners, sampled(surface.areas))
    off = float((np.abs(winding - 0.5) > NEAR_HALF).mean())
    if off > SMALL_SHARE:
        raise _crossing(off)


def outward_sheets(found: SoundSurface, *, largest_part: bool) -> SoundSurface:
    """Orient the parts of an open surface outwards."""
    label, said = found.connected, list[str]()
    mesh, whole, count = Mesh(found.vertices, found.triangles), found.areas.sum(), label.max() + 1
    if largest_part:
        kept = label == np.bincount(label, weights=mesh.areas).argmax()
        mesh = Mesh(mesh.vertices, mesh.triangles[kept])
        label = np.zeros(len(mesh.triangles), np.int64)
    sizes = np.bincount(label, weights=mesh.areas)
    winding = _winding_of_parts(mesh, label)
    turn = winding * (1.0 if sizes @ winding > 0.0 else -1.0) < -NEAR_HALF
    turn ^= bool(sizes @ winding < 0.0)
    if turn.any():
        turned = np.where(turn[label][:, None], mesh.triangles[:, ::-1], mesh.triangles)
        mesh = Mesh(mesh.vertices, turned)
        winding = _winding_of_parts(mesh, label)
        said.append(f"{int(turn.sum())} of {len(sizes)} parts of the open surface were inside out; "
                    "their triangles were turned")  # fmt: skip
    sound = np.abs(winding - 0.5) <= NEAR_HALF
    mean = float(sizes @ winding / sizes.sum())
    unsound = float(sizes[~sound].sum()) / whole
    if unsound > SMALL_SHARE and mean > CERTAIN:
        raise _crossing(unsound)
    if unsound > SMALL_SHARE or not mean >= CERTAIN:
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
FEWEST_SAMPLES, MOST_SAMPLES = 32, 256
ANGLES_AT_ONCE = 20_000
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
    step = max(ANGLES_AT_ONCE // len(corners), 1)
    axes = np.ascontiguousarray(corners.transpose(2, 1, 0))
    for start in range(0, len(places), step):
        asked = places[start : start + step]
        angles = solid_angles(axes, corners[asked].mean(axis=1))
        angles[np.arange(len(asked)), asked] = 0.0
        found[start : start + step] = angles.sum(axis=1) / (4.0 * math.pi)
    return found


def solid_angles(axes: Array, points: Array) -> Array:
    """Return signed solid angles of triangles (3, 3, t), coordinates first, (points, t)."""
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
    """Wind triangles as most of their part by area; also say which turned. None if one-sided."""
    edges = MeshEdges.of(corners)
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
