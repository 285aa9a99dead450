"""Finds where the links of a hand are near an object, how deep they stand in it and in each other.

Each shape of a link and each convex piece of the object is a pair, with MuJoCo's signed distance:
the distance between the two, or, where they overlap, minus the length of the shortest way by which
one can be moved off the other. A pair of flat sides, or of a side and an edge, has further
contacts, which MuJoCo finds where the two are within some degrees of each other; those count whose
normals are that of the shortest way.

Where pieces touch or overlap, the nearest point of a piece may be inside the object, or on an edge
that is none of the object's. Such a point counts for the depth alone. A point is a contact if, of
the object's surface, it is nearest to what is a little way off along the normal: then the normal is
one of the surface at the point. Where a link overlaps several pieces by less than the object, as
near the sides that they have in common, it may have no contact.
"""

# pyright: basic, reportAttributeAccessIssue=false
# MuJoCo ships no types for its core.

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.compiled import compiled
from grasp_core.hands.collisions import surface_tree
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact
from scenes.mujoco.filed_hand import OWN, FiledHand
from scenes.mujoco.mjcf_text import SceneText, quaternion
from scenes.silent_mujoco import mujoco, unlogged

ITERATIONS, TOLERANCE_M = 500, 1e-12
"""Most steps of a search for a distance, and its tolerance [m]: with MuJoCo's own, distances of
round shapes are off by up to half a millimetre."""
BEYOND_M = 1e-3
"""How far beyond the distance asked for pairs are looked at [m]: further contacts of a pair, which
are all that MuJoCo lists, may be farther away than the nearest."""
TOUCHING_M = 1e-9
"""Distance up to which the shortest way has no direction, and that of MuJoCo's contact counts."""
SAME_NORMAL, SAME_M = np.cos(np.radians(0.5)), 1e-6
"""Least cosine between the normal of a further contact and the shortest way; and how much longer
the way there may be where it stands for the shortest, too [m]."""
OFF_M, OFF_COSINE = 1e-4, 0.999
"""How far off the surface it is tried whether a point is the nearest [m], and least cosine between
the normal and the way to the nearest: 2.5 degrees."""
APART_M, ALIKE = 1e-3, 0.99
"""Distance and cosine between normals up to which contacts of a link are one."""


@dataclass(frozen=True, slots=True, eq=False)
class LinkContact:
    """A place where a link of a hand is near the object's surface."""

    link: str
    contact: Contact
    """The point of the object's surface, and its normal into the object, in the object's frame."""
    distance_m: float
    """Signed distance of link and object, negative where they overlap [m]."""
    lever: Array
    """What turns a force on the object there into torques of the j joints, (j, 3) [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Stood:
    """What is found of a hand where it stands."""

    contacts: tuple[LinkContact, ...]
    """Contacts with the object's surface, the deepest first."""
    depth_m: float
    """How deep hand and object stand in each other, zero where they do not [m]."""
    own_depth_m: float
    """How deep links of the hand stand in each other, of those that may meet [m]."""


class ContactFinder:
    """Finds the contacts of one hand, whose root moves as told, with one object."""

    def __init__(self, scene: SceneText, hand: FiledHand, body: Polyhedron, near_m: float) -> None:
        """Compile a scene of the hand; contacts are found up to a distance `near_m` [m]."""
        with unlogged():
            self.model = mujoco.MjModel.from_xml_string(scene.xml)
        self.data, self.near_m = mujoco.MjData(self.model), near_m
        self.body, self.tree = body, surface_tree(body)
        self.model.opt.ccd_iterations, self.model.opt.ccd_tolerance = ITERATIONS, TOLERANCE_M
        self.object = self.model.body("object").id
        own = self.model.geom_bodyid == self.object
        self.model.geom_margin[own] = self.model.geom_gap[own] = near_m + BEYOND_M
        self.model.body_margin[self.object] = near_m + BEYOND_M  # else bodies are passed over
        joints = [self.model.joint(OWN.format(name)) for name in hand.joint_names]
        self.angles = [int(joint.qposadr[0]) for joint in joints]
        self.speeds = [int(joint.dofadr[0]) for joint in joints]

    def stood(self, root: Array, joints: Array) -> Stood:
        """Find the contacts of a hand in a pose.

        Args:
            root: Pose of the hand's root in the object's frame, (4, 4) [m].
            joints: Joint angles in the order of the hand's file, (j,) [rad].
        """
        self._place(root, joints)
        found, deepest, own = list[tuple[float, int, Array, Array]](), 0.0, 0.0
        listed: Indices = self.data.contact.geom
        for pair in np.unique(listed, axis=0):
            ends, (one, other) = np.empty(6), self.model.geom_bodyid[pair].tolist()
            far = self.near_m + BEYOND_M
            apart = mujoco.mj_geomDistance(self.model, self.data, *pair.tolist(), far, ends)
            if self.object not in (one, other):
                own = max(own, -apart)
                continue
            deepest = max(deepest, -apart)
            link, sign = (other, -1.0) if one == self.object else (one, 1.0)
            rows = np.flatnonzero((listed == pair).all(axis=1))
            for distance, point, normal in self._places(apart, ends, sign, rows):
                if distance <= self.near_m:
                    found.append((distance, link, point + self.body.center_of_mass, normal))
        found.sort(key=lambda each: each[0])
        return Stood(tuple(self._contacts(found)), deepest, own)

    def levers(self, contacts: Sequence[LinkContact]) -> Array:
        """Return the levers of contacts side by side, (j, 3k) [m], as `Motors` has them."""
        return np.hstack([np.zeros((len(self.speeds), 0)), *(each.lever for each in contacts)])

    def _place(self, root: Array, joints: Array) -> None:
        data = self.data
        data.mocap_pos[0] = root[:3, 3] - self.body.center_of_mass
        data.mocap_quat[0] = quaternion(root[:3, :3])
        data.qpos[self.angles] = joints
        with unlogged():
            mujoco.mj_kinematics(self.model, data)
            mujoco.mj_comPos(self.model, data)
            mujoco.mj_collision(self.model, data)

    def _places(
        self, apart: float, ends: Array, sign: float, rows: Indices
    ) -> Iterator[tuple[float, Array, Array]]:
        """Yield distances of a pair, points of the object and normals into it.

        Takes the ends of the shortest way, and -1 where the object has the first, else 1.
        """
        listed = self.data.contact
        normals = sign * listed.frame.reshape(-1, 9)[rows, :3]
        way = sign * (ends[3:] - ends[:3]) / apart if abs(apart) > TOUCHING_M else normals[0]
        rows = rows[normals @ way > SAME_NORMAL]
        if not (listed.dist[rows] < apart + SAME_M).any():
            yield apart, ends[3:] if sign > 0.0 else ends[:3], way
        for row in rows.tolist():
            normal, distance = sign * listed.frame[row, :3], float(listed.dist[row])
            yield distance, listed.pos[row] + 0.5 * distance * normal, normal

    def _contacts(self, found: Sequence[tuple[float, int, Array, Array]]) -> Iterator[LinkContact]:
        """Yield what is on the surface, once where several pieces have it in common."""
        kept = list[tuple[int, Array, Array]]()
        for distance, link, point, normal in found:
            if self._is_on_surface(point, normal) and not any(
                link == other and np.linalg.norm(point - at) < APART_M and normal @ along > ALIKE
                for other, at, along in kept
            ):
                kept.append((link, point, normal))
                lever = np.zeros((3, self.model.nv))
                place = point - self.body.center_of_mass
                mujoco.mj_jac(self.model, self.data, lever, None, place, link)
                name = self.model.body(link).name
                yield LinkContact(name, Contact(point, normal), distance, lever[:, self.speeds].T)

    def _is_on_surface(self, point: Array, normal: Array) -> bool:
        """Return whether, of the surface, a point is nearest to what is a little way off it.

        What is off a side between two pieces is nearest to that of the other piece, from within.
        """
        kernel = compiled("grasp_core.hands.distances_kernel")
        off, near = point - OFF_M * normal, np.empty(3)
        triangle = kernel.nearest(off, 2.0 * OFF_M, self.tree, near)
        way = near - off
        least = OFF_COSINE * max(float(np.linalg.norm(way)), 0.5 * OFF_M)
        along, out = float(way @ normal), float(way @ self.tree.normals[triangle])
        return triangle >= 0 and along >= least and out < least
