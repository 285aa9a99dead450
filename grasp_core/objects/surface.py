"""Defines meshes with their edges and parts, faces, and what is known of an object's surface.

Whatever depends on how far a mesh can be trusted asks here. An orientation that is not certain has
no field, because such meshes are refused. Groups of triangles near a plane grow from seeds across
shared edges, measured against one plane and never from neighbour to neighbour, so that the facets
of a fine sphere cannot creep into one "face"; the plane is fitted again to what has grown.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated, Literal, NamedTuple, TypeAlias

import numpy as np
from annotated_types import Interval
from numpy.typing import NDArray

from grasp_core.allowed_values import LARGEST, NotNegative, Number
from grasp_core.arrays import Array, Indices, Point, Polygon, Shape, UnitVector
from grasp_core.by_value import counted, summary
from grasp_core.declared import Declared, declared
from grasp_core.errors import MeshError, MeshRefusal
from grasp_core.messages import MILLI
from grasp_core.values import RIGHT_ANGLE

TRIANGLES_AT_EDGE = 2
NO_CAPS = np.empty(0, dtype=np.int64)

Plane: TypeAlias = tuple[Array, Array]
"""A plane by its unit normal and a point on it, (3,) each."""
Fit: TypeAlias = Callable[[Indices, Plane], NDArray[np.bool_]]
"""A function that tells which of some triangles fit a plane, (t,)."""


def crosses_of(corners: Array) -> Array:
    """Compute normals of triangles (t, 3, 3) that are twice as long as their areas, (t, 3)."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def areas_and_normals(corners: Array) -> tuple[Array, Array]:
    """Compute areas (t,) and unit normals (t, 3) of triangles (t, 3, 3); zero without an area."""
    crosses = crosses_of(corners)
    lengths = np.linalg.norm(crosses, axis=1)
    return 0.5 * lengths, crosses / np.where(lengths > 0.0, lengths, 1.0)[:, None]


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles between vertices, and what follows from them; each is computed once."""

    vertices: Array  # (n, 3) [m]
    triangles: Indices  # vertex indices, (t, 3)

    def with_triangles(self, triangles: Indices) -> "Mesh":
        """Return some triangles between these vertices, with the vertices that they use."""
        used, local = np.unique(triangles, return_inverse=True)
        return Mesh(self.vertices[used], local.reshape(-1, 3))

    @cached_property
    def extent(self) -> float:
        """Largest extent along an axis [m]."""
        return float(np.ptp(self.vertices, axis=0).max())

    @cached_property
    def corners(self) -> Array:
        """Corners of the triangles, (t, 3, 3) [m]."""
        return self.vertices[self.triangles]

    @cached_property
    def _measured(self) -> tuple[Array, Array]:
        return areas_and_normals(self.corners)

    @property
    def areas(self) -> Array:
        """Areas of the triangles, (t,) [m^2]."""
        return self._measured[0]

    @property
    def normals(self) -> Array:
        """Unit normals, as the triangles are wound; zero without area, (t, 3)."""
        return self._measured[1]

    @property
    def volume(self) -> float:
        """Volume that the triangles enclose [m^3]; it is negative where they are inside out."""
        corners = self.corners - self.vertices.mean(axis=0)
        return float(np.linalg.det(corners).sum()) / 6.0

    @cached_property
    def edges(self) -> "MeshEdges":
        """The edges of the triangles."""
        return MeshEdges.of(self.triangles)

    @cached_property
    def across(self) -> Indices:
        """The one triangle across each edge (k, k+1), (t, 3); -1 where there is none."""
        return self.edges.neighbours()

    @cached_property
    def connected(self) -> Indices:
        """Number of the part of each triangle; parts connect across edges of two triangles."""
        here, side = np.nonzero(self.across >= 0)
        return numbered(len(self.triangles), np.column_stack([here, self.across[here, side]]))

    def fitted(self, members: Indices) -> Plane:
        """Fit a plane to triangles."""
        weights = self.areas[members]
        mean = weights @ self.normals[members]
        length = float(np.linalg.norm(mean))
        if length == 0.0:
            return self.normals[members[0]], self.corners[members[0], 0]
        middle = weights @ self.corners[members].mean(axis=1) / weights.sum()
        return mean / length, middle

    def groups(
        self, seeds: Iterable[int], first_plane: Callable[[int], Plane], fit: Fit, fits: int,
        caps: Indices,
    ) -> Iterator[tuple[Indices, Plane]]:  # fmt: skip
        """Yield the triangles of each group, and its plane; no triangle is in two groups.

        A group grows over the triangles that `fit` its plane, `fits` times, each time with a plane
        that is fitted to what grew before; one whose seed does not fit any more stays as it was.
        """
        free = np.ones(len(self.areas), dtype=np.bool_)
        free[caps] = False
        for seed in seeds:
            if not free[seed]:
                continue
            plane, group = first_plane(seed), None
            for _ in range(fits):
                if group:
                    plane = self.fitted(group[0])
                if not len(members := self._grown(seed, plane, fit, free)):
                    break
                group = members, plane
            free[seed] = False
            if group:
                free[group[0]] = False
                yield group

    def _grown(self, seed: int, plane: Plane, fit: Fit, free: NDArray[np.bool_]) -> Indices:
        """Collect the free triangles near a plane that connect with a seed; leaves `free` as is."""
        near, members = np.array([seed]), list[Indices]()
        while len(near := near[fit(near, plane)]):
            free[near] = False
            members.append(near)
            after = np.unique(self.across[near])
            after = after[after >= 0]
            near = after[free[after]]
        found = np.concatenate([*members, near])
        free[found] = True
        return found


class MeshEdges(NamedTuple):
    """The edges between the vertices of triangles, and how the triangles run along them."""

    corners: Indices  # vertex indices of the triangles, (t, 3)
    place: Indices  # number of the edge (k, k+1) of each triangle, (3 t,)
    uses: Indices  # number of triangles at each edge, (e,)
    balance: Indices  # how many more run along an edge to the higher vertex than back, (e,)

    @classmethod
    def of(cls, corners: Indices) -> "MeshEdges":
        """Number the edges of triangles."""
        tail, head = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
        names = np.minimum(tail, head) * (int(corners.max()) + 1) + np.maximum(tail, head)
        place = np.unique(names, return_inverse=True)[1].ravel()
        uses = np.bincount(place)
        ahead = np.bincount(place[tail < head], minlength=len(uses))
        return cls(corners, place, uses, 2 * ahead - uses)

    @property
    def against(self) -> NDArray[np.bool_]:
        """Which edges two triangles run along in the same direction, (e,)."""
        return (self.uses == TRIANGLES_AT_EDGE) & (self.balance != 0)

    def neighbours(self) -> Indices:
        """Find the one triangle across each edge, (t, 3); -1 if there is none, or several."""
        order = np.argsort(self.place, kind="stable")
        paired = order[(self.uses == TRIANGLES_AT_EDGE)[self.place[order]]].reshape(
            -1, TRIANGLES_AT_EDGE
        )
        across = np.full(len(self.place), -1, dtype=np.int64)
        across[paired[:, 0]], across[paired[:, 1]] = paired[:, 1] // 3, paired[:, 0] // 3
        return across.reshape(-1, 3)

    def parts(self) -> Indices:
        """Number the part that each triangle belongs to; parts share no edge, (t,)."""
        here = np.repeat(np.arange(len(self.corners)), 3)
        first = np.empty(len(self.place), dtype=np.int64)
        first[self.place[::-1]] = here[::-1]
        return numbered(len(self.corners), np.column_stack([here, first[self.place]]))

    def fault(self) -> MeshError | None:
        """Return the fault by which triangles bound no solid, or None if they do."""
        if same_side := int(self.against.sum()):
            message = (
                f"{same_side} edges have triangles of opposite orientation; wind all "
                "triangles counter-clockwise seen from outside"
            )
            return MeshError(MeshRefusal.WINDING, message)
        if open_edges := int((self.uses == 1).sum()):
            message = (
                f"{open_edges} edges belong to one triangle only; close the surface, or use its "
                "sound parts (--faces patches) with the volume of the convex hull"
            )
            return MeshError(MeshRefusal.OPEN, message)
        if (self.uses != TRIANGLES_AT_EDGE).any():
            edge = int(np.argmax(self.uses != TRIANGLES_AT_EDGE))
            row, side = divmod(int(np.argmax(self.place == edge)), 3)
            ends = sorted((int(self.corners[row, side]), int(self.corners[row, (side + 1) % 3])))
            message = (
                f"edge {ends} belongs to {self.uses[edge]} triangles"
                ", expected two; separate the parts there, or use sound parts (--faces patches)"
            )
            return MeshError(MeshRefusal.NON_MANIFOLD, message)
        return None

    def open_loops(self) -> list[list[int]] | None:
        """Walk along open edges against their triangles; None where walks may not return."""
        if ((self.uses > 1) & (self.balance != 0)).any():
            return None
        tails, heads = self.corners.ravel(), np.roll(self.corners, -1, axis=1).ravel()
        leaving: dict[int, list[int]] = {}
        for edge in np.flatnonzero(self.uses[self.place] == 1).tolist():
            leaving.setdefault(int(heads[edge]), []).append(int(tails[edge]))
        loops = list[list[int]]()
        for start in list(leaving):
            while leaving[start]:
                walk = [start]
                while (vertex := leaving[walk[-1]].pop()) != start:  # each step uses up an edge
                    walk.append(vertex)
                loops += cut_at_repeats(walk)
        return loops


def border_loops(triangles: Indices) -> list[list[int]]:
    """Walk along the borders of triangles, wound like them; loops pass each vertex once."""
    inside = {
        (int(t[k]), int(t[(k + 1) % 3])): int(t[(k + 2) % 3]) for t in triangles for k in range(3)
    }
    unseen = dict.fromkeys(edge for edge in inside if edge[::-1] not in inside)
    loops = list[list[int]]()
    while unseen:
        edge = next(iter(unseen))
        loop: list[int] = []
        while edge in unseen:
            del unseen[edge]
            loop.append(edge[0])
            pivot, apex = edge[1], inside[edge]
            while (apex, pivot) in inside:
                apex = inside[apex, pivot]
            edge = pivot, apex
        loops += cut_at_repeats(loop)
    return loops


def cut_at_repeats(walk: list[int]) -> list[list[int]]:
    """Cut a closed walk into loops, one wherever a vertex is met again."""
    loops, current, place = list[list[int]](), list[int](), dict[int, int]()
    for vertex in walk:
        if vertex in place:
            loops.append(current[place[vertex] :])
            del current[place[vertex] :]
            for passed in loops[-1]:
                del place[passed]
        place[vertex] = len(current)
        current.append(vertex)
    return [*loops, current]


def components(count: int, links: Indices) -> Indices:
    """Return for each item the least index among the items connected with it, (count,).

    Items point to items of their set, in the end to the least one. In each round the item that a
    linked one points to is made to point to the least one at the other ends, and then every item
    to the end of its way. Rounds grow as the square of the logarithm of `count` at most, and there
    are fifteen for a million items in a row of any order.

    Source:
        Liu and Tarjan, "Simple concurrent labeling algorithms for connected components", SOSA 2019.
    """
    least = np.arange(count)
    apart = links
    while len(apart):
        low, high = np.sort(apart, axis=1).T
        np.minimum.at(least, high, low)
        while not np.array_equal(further := least[least], least):
            least = further
        apart = least[apart]
        apart = apart[apart[:, 0] != apart[:, 1]]
    return least


def numbered(count: int, links: Indices) -> Indices:
    """Give each item the number of its connected part, in order of first items, (count,)."""
    return np.unique(components(count, links), return_inverse=True)[1]


Places = Annotated[Indices, Shape(None, whole=True)]
"""Places of things in a list, (n,)."""


@declared
class Face(Declared):
    """A planar face: one outer border, perhaps holes, and a split into convex pieces."""

    normal: UnitVector
    """Unit vector into the object, (3,)."""
    centroid: Point
    """Centre of area, on the plane, (3,) [m]."""
    area: Annotated[float, Interval(gt=0.0, le=LARGEST)]
    """Area of the face without its holes [m^2]."""
    polygon: Polygon
    """Outer border, (k, 3) [m], counter-clockwise when `normal` points at the viewer."""
    holes: tuple[Polygon, ...]
    """Borders of the holes, each (k, 3) [m], clockwise in the same view."""
    pieces: tuple[Polygon, ...]
    """Convex polygons that tile the face, each (k, 3) [m], wound as `polygon`."""
    spread: Annotated[float, Interval(ge=0.0, lt=RIGHT_ANGLE)] = 0.0
    """Largest angle between the surface and the plane of a curved patch [rad]."""
    depth: NotNegative = 0.0
    """Largest distance of the surface from the plane of a curved patch [m]."""
    facets: Places = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    """Indices of the triangles over a curved patch, (f,); empty for an exact face."""

    def __repr__(self) -> str:
        parts = [counted(len(self.polygon), "corner"), counted(len(self.holes), "hole")]
        return summary("Face", *parts, area=self.area, centroid=self.centroid, normal=self.normal)


@declared
class Surface(Declared):
    """What is known of an object's triangles."""

    closed: bool = True
    """Whether the triangles, caps included, enclose a solid. Where they do not, the mass properties
    are those of the convex hull."""
    caps: Places = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    """Indices of triangles on which no finger may stand, (c,): those that close small holes, and
    the walls of voids that are sealed from the outside."""
    holes: Number = 0
    """Number of holes that were closed."""
    largest_hole_m: NotNegative = 0.0
    """Largest distance between two corners of one closed hole [m]."""
    volume_error: NotNegative = 0.0
    """Largest error of the volume if each closed hole was half an ellipsoid, as a share of it."""
    dropped: Annotated[float, Interval(ge=0.0, le=1.0)] = 0.0
    """Area of the parts that were left out, as a share of the whole."""
    flatness_m: NotNegative = 0.0
    """Distance from one plane that the rounding of the coordinates explains [m]; 0 where no more is
    known of them than that they are in double precision."""
    center_given: bool = False
    """Whether the centre of mass was given, and is not that of uniform density."""
    repairs: tuple[str, ...] = ()
    """What else was changed, in words."""

    @property
    def volume_source(self) -> Literal["surface", "capped surface", "convex hull"]:
        """What the mass properties are computed from."""
        if not self.closed:
            return "convex hull"
        return "capped surface" if self.holes else "surface"

    def notes(self) -> Iterator[str]:
        """Yield what people must know of the surface, a sentence each."""
        yield from self.repairs
        if self.holes:
            yield (
                f"{self.holes} hole{'s' * (self.holes > 1)} in the surface, at most "
                f"{MILLI * self.largest_hole_m:.3g} mm wide, "
                f"{'are' if self.holes > 1 else 'is'} closed for volume and centre of mass, which "
                f"makes the volume uncertain by at most {100.0 * self.volume_error:.2g} %; no "
                "finger is placed there"
            )
        if not self.closed:
            what = "its volume is" if self.center_given else "its volume and centre of mass are"
            yield f"the surface is open, so {what} of the convex hull, and a density gives no mass"


@dataclass(frozen=True, eq=False)
class SoundSurface(Mesh):
    """Welded and consistently wound triangles, with what is known of them."""

    surface: Surface

    def mended(
        self, mesh: Mesh, caps: Indices, dropped: float, said: Sequence[str]
    ) -> "SoundSurface":
        """Return the surface with other triangles, made by dropping a share and by what is said."""
        known = replace(
            self.surface,
            caps=caps,
            dropped=max(self.surface.dropped, dropped),
            repairs=(*self.surface.repairs, *said),
        )
        return SoundSurface(mesh.vertices, mesh.triangles, known)
