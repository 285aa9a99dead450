"""Tells parts of a mesh apart that touch each other, and lets touching faces overlap a little.

Solved: a closed surface in which more than two triangles meet at some edges is made one in which
two do, by doubling vertices. Turning counter-clockwise about an edge, directed from its lower to
its higher vertex, material begins at triangles that run back along it, and ends at those that run
ahead. A begin and the end that follows bound the same wedge of material, and stay together. Where
one part ends and another begins in one direction, the end comes first, so that parts which share a
face are told apart. Triangles that connect elsewhere stay together if they pair up by themselves.

Also solved: parts whose faces touch up to rounding are made to overlap, so that their union has no
slits. A vertex of a touching triangle moves outwards across all planes that touch there, by the
least way that takes each plane past the other part.

Bound: no vertex moves by more than `FARTHEST_MOVE` times the largest gap and the depth of the
overlap together, so the union's surface is as near to the surfaces of the parts.
"""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.objects.planar_faces import ANGLE
from grasp_core.objects.surface import TRIANGLES_AT_EDGE, Mesh, components

FARTHEST_MOVE = 2.0
"""Largest distance that a vertex moves, over that of the farthest plane that it passes."""
OPPOSED = -0.998
"""Largest cosine between the normals of touching triangles: small ones lean by their rounding."""
SAME_PLANES = 0.02
"""Least singular value of normals that count as different, over the largest."""
MOST_PAIRS = 50_000_000
"""Largest number of pairs of triangles of two parts that are compared, which takes a second."""
PAIRS_AT_ONCE = 500_000
NO_PAIRS = np.empty(0, dtype=np.int64), np.empty(0), np.empty(0)


def pulled_apart(mesh: Mesh) -> Mesh | None:
    """Double vertices so that two triangles meet at each edge; None if it is not clear which."""
    edges = mesh.edges
    if edges.balance.any() or not (edges.uses > TRIANGLES_AT_EDGE).any():
        return None
    order = np.argsort(edges.place, kind="stable")
    paired = order[(edges.uses == TRIANGLES_AT_EDGE)[edges.place[order]]].reshape(
        -1, TRIANGLES_AT_EDGE
    )
    crowded = _wedges(mesh)
    if crowded is None:
        return None
    one, two = np.concatenate([paired, crowded]).T
    links = np.column_stack([one, _head(two), _head(one), two]).reshape(-1, 2)
    _, first, corners = np.unique(
        components(mesh.triangles.size, links), return_index=True, return_inverse=True
    )
    found = Mesh(mesh.vertices[mesh.triangles.ravel()[first]], corners.reshape(-1, 3))
    return None if found.edges.fault() else found


def _head(sides: Indices) -> Indices:
    """Return the corner at which the sides (k, k+1) of triangles end, each 3 t + k."""
    return sides - sides % 3 + (sides + 1) % 3


def _wedges(mesh: Mesh) -> Indices | None:
    """Pair the sides of triangles at crowded edges that bound the same material, (p, 2)."""
    edges, corners = mesh.edges, mesh.triangles.ravel()
    side = np.flatnonzero((edges.uses > TRIANGLES_AT_EDGE)[edges.place])
    place, part, tail, head = edges.place[side], mesh.connected[side // 3], side, _head(side)
    ends = corners[tail] < corners[head]
    alone = np.unique(np.column_stack([place, part]), axis=0, return_inverse=True)[1].ravel()
    uneven = np.bincount(alone, weights=np.where(ends, 1.0, -1.0)) != 0.0
    mixed = np.bincount(place, weights=uneven[alone], minlength=len(edges.uses)) > 0.0
    own = np.column_stack([place, np.where(mixed[place], -1, part)])
    group = np.unique(own, axis=0, return_inverse=True)[1].ravel()
    # angles about the edge, from the first triangle at which material begins
    low, high = (mesh.vertices[f(corners[tail], corners[head])] for f in (np.minimum, np.maximum))
    along = (high - low) / np.linalg.norm(high - low, axis=1, keepdims=True)
    away = mesh.vertices[corners[_head(head)]] - low
    away -= np.einsum("si,si->s", away, along)[:, None] * along
    begins_first = np.lexsort((ends, group))
    start = away[begins_first[np.unique(group[begins_first], return_index=True)[1]]][group]
    across = np.einsum("si,si->s", along, np.cross(start, away))
    angles = np.arctan2(across, np.einsum("si,si->s", start, away)) % (2.0 * np.pi)
    angles[angles > 2.0 * np.pi - ANGLE] -= 2.0 * np.pi
    order = np.lexsort((angles, group))
    later = (np.diff(group[order]) > 0) | (np.diff(angles[order]) > ANGLE)
    order = order[np.lexsort((~ends[order], np.append(0, np.cumsum(later))))]
    # each begin is followed by its end, the last one of an edge by the first end
    last = np.append(np.diff(group[order]) > 0, True)
    after = np.arange(1, len(order) + 1)
    after[last] = np.append(0, after[last][:-1])
    begins = ~ends[order]
    if not ends[order][after[begins]].all():
        return None
    return np.column_stack([side[order[begins]], side[order[after[begins]]]])


def pressed_together(
    bodies: Sequence[Mesh], reach: float, depth: float
) -> tuple[list[Array], list[tuple[int, int]]]:
    """Let faces that are at most `reach` apart [m] overlap by a depth [m].

    Gives the vertices of each body, (n, 3) [m], and the pairs of bodies that have such faces, or
    are too fine for them to be looked for. Of two bodies the one with less surface changes.
    """
    pairs = list[tuple[int, int]]()
    places = [body.vertices.copy() for body in bodies]
    planes: list[dict[int, list[tuple[Array, float]]]] = [{} for _ in bodies]
    by_area = sorted(range(len(bodies)), key=lambda k: float(bodies[k].areas.sum()))
    for small, large in combinations(by_area, 2):
        mine = bodies[small]
        found = _touching(mine, bodies[large], reach)
        if found is None or len(found[0]):
            pairs.append((small, large))
        for triangle, gap, _ in zip(*(found or NO_PAIRS), strict=True):
            for vertex in mine.triangles[triangle].tolist():
                plane = mine.normals[triangle], max(gap + depth, 0.0)
                planes[small].setdefault(vertex, []).append(plane)
    for place, own in zip(places, planes, strict=True):
        for vertex, there in own.items():
            place[vertex] += _step(there)
    return places, pairs


def widest_gap(bodies: Sequence[Mesh], most: float) -> float | None:
    """Return the largest distance of faces that touch up to `most` [m]; None if none do."""
    pairs = combinations(bodies, 2)
    gaps = np.concatenate([(_touching(one, two, most) or NO_PAIRS)[2] for one, two in pairs])
    return float(gaps.max()) if len(gaps) else None


def _step(planes: list[tuple[Array, float]]) -> Array:
    """Return the least step past some planes, by their normals and distances, (3,) [m]."""
    N, d = np.array([normal for normal, _ in planes]), np.array([way for _, way in planes])
    step = np.asarray(np.linalg.lstsq(N, d, rcond=SAME_PLANES)[0], dtype=np.float64)
    passed = N @ step
    if (passed > 0.0).all():
        step *= max(1.0, float((d / passed).max()))
    length = float(np.linalg.norm(step))
    return step * min(1.0, FARTHEST_MOVE * float(np.abs(d).max()) / length) if length else step


def _touching(mine: Mesh, other: Mesh, reach: float) -> tuple[Indices, Array, Array] | None:
    """Find pairs of facing triangles of two meshes that are near each other in more than an edge.

    Gives the triangle of `mine` in each pair, how far it must move to be past the other (negative
    where it is past it), and its distance from the other, (p,) each [m]; None for too many.
    """
    here, there, found = _beside(mine, other, reach), _beside(other, mine, reach), [NO_PAIRS]
    if len(here) * len(there) > MOST_PAIRS:
        return None
    step = max(PAIRS_AT_ONCE // max(len(there), 1), 1)
    for start in range(0, len(here), step):
        some = here[start : start + step]
        a, b = np.nonzero(mine.normals[some] @ other.normals[there].T <= OPPOSED)
        a, b = some[a], there[b]
        one, two = mine.corners[a], other.corners[b]
        up: Array = np.einsum("pki,pi->pk", two - one[:, :1], mine.normals[a])
        down: Array = np.einsum("pki,pi->pk", one - two[:, :1], other.normals[b])
        # where they face each other, they are as near as the corners of the nearer one
        far_up, far_down = np.abs(up).max(axis=1), np.abs(down).max(axis=1)
        own = np.where((far_up <= far_down)[:, None], up, down)
        far = np.minimum(far_up, far_down)
        near = np.flatnonzero(far <= reach)
        near = near[_overlap(one[near], two[near], mine.normals[a[near]]) > reach]
        found.append((a[near], own[near].max(axis=1), far[near]))
    one, gap, far = (np.concatenate(column) for column in zip(*found, strict=True))
    return one, gap, far


def _beside(mine: Mesh, other: Mesh, reach: float) -> Indices:
    """List the triangles of a mesh that are near the box around another one."""
    low, high = other.vertices.min(axis=0) - reach, other.vertices.max(axis=0) + reach
    least, most = mine.corners.min(axis=1), mine.corners.max(axis=1)
    return np.flatnonzero(((least <= high) & (most >= low)).all(axis=1))


def _overlap(one: Array, two: Array, normals: Array) -> Array:
    """Return how far triangles (p, 3, 3) must move in their planes to be side by side, (p,)."""
    least = np.full(len(one), np.inf)
    for corners in (one, two):
        axes = np.cross(np.roll(corners, -1, axis=1) - corners, normals[:, None])
        axes /= np.linalg.norm(axes, axis=2, keepdims=True)
        mine, other = (np.einsum("pki,pai->pak", each, axes) for each in (one, two))
        shared = np.minimum(mine.max(axis=2), other.max(axis=2)) - np.maximum(
            mine.min(axis=2), other.min(axis=2)
        )
        least = np.minimum(least, shared.min(axis=1))
    return least
