"""Defines the arrays that compiled loops read and change: hands, surfaces, aims and poses."""

from typing import NamedTuple

from grasp_core.arrays import Array, Indices


class HandArrays(NamedTuple):
    """A hand in arrays: j joints, one link each, f fingers, s shapes, b balls.

    A ball stands for a part of a link before the last of its finger while a pose is sought; shapes
    decide.
    """

    positions: Array
    """Origins of the links' frames in those of the links before them, (j, 3) [m]."""
    rotations: Array
    """Axes of these frames at the angle zero, (j, 3, 3)."""
    axes: Array
    """Axes of the joints, (j, 3)."""
    ranges: Array
    """Lowest and highest angles, (j, 2) [rad]."""
    drivers: Indices
    """Joint that each joint follows, or its own number: see `couplings`, as for the next, (j,)."""
    ratios: Array
    """(j,)."""
    offsets: Array
    """(j,) [rad]."""
    starts: Indices
    """First link of each finger, and the number of links at the end, (f + 1,)."""
    tip_centers: Array
    """Middles of the fingertips' balls in the frames of the last links, (f, 3) [m]."""
    tip_radii: Array
    """Radii of these balls, (f,) [m]."""
    tip_corners: Array
    """Corners of all fingertips, finger by finger: for a ball its middle, (c, 3) [m]."""
    cover_corners: Array
    """Corners of blocks in the frames of the shapes that cover them, zeros for balls, (c, 3)."""
    tip_firsts: Indices
    """First corner of each finger, and the number of corners at the end, (f + 1,)."""
    tip_roundings: Array
    """Distances from the hulls of these corners to the tips' surfaces, (f,) [m]."""
    tip_shapes: Indices
    """The shape that is each finger's ball, or covers its block, (f,)."""
    shape_links: Indices
    """The link of each shape, -1 for the palm, (s,)."""
    shape_positions: Array
    """Middles of the shapes in the links' frames, (s, 3) [m]."""
    shape_rotations: Array
    """Axes of the shapes in the links' frames, (s, 3, 3)."""
    shape_sizes: Array
    """Half-sizes of the shapes' boxes, (s, 3) [m]."""
    shape_radii: Array
    """Distances from the boxes to the surfaces, (s,) [m]."""
    shape_reaches: Array
    """Largest distances of the shapes' points from their middles, (s,) [m]."""
    shape_tips: Indices
    """The finger whose tip a shape stands for: it shares the tip's ball or covers its corners; -1
    for none, (s,)."""
    link_shapes: Indices
    """For the palm and each link, the shape about whose middle a ball holds all of its shapes, or
    -1 if it has none, (j + 1,)."""
    link_reaches: Array
    """Radii of these balls, (j + 1,) [m]."""
    pairs: Indices
    """Pairs of shapes of one hand that must not overlap, (p, 2)."""
    ball_links: Indices
    """The link of each ball, -1 for the palm, (b,)."""
    ball_centers: Array
    """Middles of the balls in the links' frames, (b, 3) [m]."""
    ball_radii: Array
    """Radii of the balls, (b,) [m]."""


class SurfaceTree(NamedTuple):
    """Triangles of a surface in a binary tree of n balls; the first is the root."""

    corners: Array
    """Corners of the triangles, in the order of the leaves, (t, 3, 3) [m]."""
    normals: Array
    """Outward unit normals, (t, 3); zero for a triangle without area."""
    numbers: Indices
    """Number of each of these triangles in the body, (t,)."""
    middles: Array
    """Middles of the balls, (n, 3) [m]."""
    radii: Array
    """Radii of the balls, (n,) [m]."""
    links: Indices
    """For each ball its two children, or a negative number and the first of its triangles: minus
    their number, (n, 2)."""


class Targets(NamedTuple):
    """Where fingertips are to touch: k contacts, e edges of regions in all."""

    fingers: Indices
    """The finger for each contact, (k,)."""
    origins: Array
    """A point of each plane, (k, 3) [m]."""
    normals: Array
    """Unit normals into the object, (k, 3)."""
    tangents: Array
    """Two unit vectors in each plane, (k, 2, 3)."""
    pinned: Array
    """1.0 where the contact must be at the origin, 0.0 where in its region, (k,)."""
    touching: Array
    """Points of the tips' hulls that touch, in the last links' frames, (k, 3) [m]; NaN where it is
    the corner that reaches farthest along the normal."""
    soft: float
    """Depth of a corner of a block below the one that reaches farthest, at which it counts less by
    the factor e as the point that touches [m]."""
    edge_contacts: Indices
    """The contact of each edge, (e,)."""
    edge_points: Array
    """A point of each edge, (e, 3) [m]."""
    edge_inward: Array
    """Unit vectors in the plane from the edge into the region, (e, 3)."""
    up: Array
    """Unit normal of the table, (3,)."""
    height: float
    """Height of the table along it [m]; minus infinity for none."""


class Wanted(NamedTuple):
    """Distances that are asked for, and what else counts."""

    clear: float
    """Distance of balls from the object and the table [m]."""
    behind: float
    """Distance of last links from the planes that their tips touch [m]."""
    apart: float
    """Distance of links from each other [m]."""
    margin: float
    """Distance of contacts from the edges of their regions [m]."""
    pull: float
    """Weight of staying near the planned contact inside a region."""
    overlaps: bool
    """Whether the first three count at all."""
    palm_moves: bool
    """Whether the palm may move."""


class Pose(NamedTuple):
    """A pose of a hand and where its parts are; the loops change the arrays in place."""

    palm: Array
    """Axes of the palm's frame, (3, 3)."""
    origin: Array
    """Its origin, (3,) [m]."""
    q: Array
    """Joint angles, (j,) [rad]."""
    R: Array
    """Axes of the links' frames, (j, 3, 3)."""
    p: Array
    """Their origins, (j, 3) [m]."""
    W: Array
    """Axes of the joints, (j, 3)."""
    turned: Array
    """Axes of the shapes, (s, 3, 3)."""
    middles: Array
    """Middles of the shapes, (s, 3) [m]."""
    tips: Array
    """Points of the tips' hulls that touch, by contact, (k, 3) [m]: middles of tips that are
    balls."""
    fronts: Array
    """Corners of the tips that are farthest along the normals, (k, 3) [m]."""
    rolls: Array
    """How points that touch move on their tips as the tips turn, (k, 3, 3) [m]."""


class Sums(NamedTuple):
    """What is summed over all residuals r with derivatives J, for n unknowns."""

    H: Array
    """J'J, its lower half, (n, n)."""
    g: Array
    """J'r, (n,)."""
    row: Array
    """The derivatives of one residual, zero between two, (n,)."""
    pivot: Array
    """Point about which the palm turns, (3,) [m]."""
    parts: Array
    """The largest distance from touching [mm], the squares of touching and of being in regions, and
    those of overlaps [mm^2], (3,)."""
