"""A hand as its file has it: the links, joints and shapes of its compiled model, as MJCF again.

The root of a hand is the world of its file, a body of its own here. It moves as told, or hangs on a
weld (see `chains`). Joints that move the whole hand, a free joint or `WRJTx` to `WRJRz` as some
sets of grasps call them, are left out: the pose of the root stands for them, and they stay as the
file draws them.

Of the shapes those are written that collide, without planes, fields of heights and distance fields.
What may meet what is as in the file, and every shape may meet the object. MuJoCo lets a link pass
its neighbour, but not where the neighbour is at rest in the world; a hand moves as a whole, so its
links pass the root's, too. Inertias, dampers, armatures, stops and couplings of joints are those of
the file. Rules that state no hardness are as hard as the simulator allows. What turns joints are
servos (see `filed_servos`).
"""

# pyright: basic, reportAttributeAccessIssue=false
# MuJoCo ships no types for its core.

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.errors import InputError
from grasp_core.quality.motors import Motors
from scenes.hand_files.fingers import WORLD, joint_name, path_of_body
from scenes.hand_files.model import USUAL_HARDNESS, HandModel, JointRule, mesh_points
from scenes.mujoco.chains import LEAST_KG, ROOT_TOLD, TIED, Weld
from scenes.mujoco.filed_servos import SLIDE_LEVER_M, FiledServos, filed_servos
from scenes.mujoco.mjcf_text import ORIGIN, Element, Parts, add_element, add_servo

ROOT_JOINT = re.compile(r"(?:.*[:/])?WRJ[TR][xyz]")
"""Names of joints that stand for the pose of a hand's root."""
OBJECT_BIT = 1 << 30
"""Bit of what only the object touches, whatever bits a hand's file uses."""
OWN = "hand/{}"
"""Names of a hand's parts, which nothing else in a scene has."""
LEAST_LEVER_M = 0.01
"""Least lever of links about joints that counts [m]."""
BALANCED_N_M = 1e-6
"""Torque by which joints that one motor pulls may be out of balance [N m]: less than any friction
in them."""
BARE_ROOT = {"pos": ORIGIN, "mass": 0.3, "diaginertia": (3e-4,) * 3}
"""Inertial of a root that hangs on a weld and has no mass in the file: about that of a palm."""
NO_SOLIDS = {"plane", "hfield", "sdf"}


@dataclass(frozen=True, slots=True, eq=False)
class FiledHand:
    """The compiled model of a hand's file, as what holds an object in a scene."""

    model: HandModel
    joints: tuple[int, ...]
    """Numbers of the joints that move, in the order of the file."""
    servos: FiledServos
    rubbing: tuple[float, float, float]
    """Coefficients of all shapes as in MJCF: sliding, torsional and rolling."""
    weld: Weld | None = None
    """What the root hangs on; None where it moves as told."""
    armature_kg_m2: float = 0.0
    """Inertia that each hinge has besides what the file says."""
    stops: bool = True
    """Whether joints stop at the ends of their ranges."""
    meets_itself: bool = True
    """Whether links touch each other where the file lets them."""

    @classmethod
    def of(
        cls, model: HandModel, rubbing: tuple[float, float, float], stiffness_n_m_per_rad: float,
        *, own_servos: bool = True, weld: Weld | None = None,
    ) -> Self:  # fmt: skip
        """Take a hand for a scene, with its own servos or with those of a stated stiffness.

        Raises:
            InputError: No joint moves the hand, one is neither a hinge nor a slide, or one that
                stands for the pose of the root does not move the whole hand.
        """
        rooted = {joint for joint, kind in enumerate(model.joint_kinds) if kind == "free"
                  or ROOT_JOINT.fullmatch(joint_name(model, joint))}  # fmt: skip
        joints = [joint for joint in range(len(model.joint_kinds)) if joint not in rooted]
        if not joints:
            raise InputError("a hand must have joints that move its links, got none")
        for joint in joints:
            path = path_of_body(model, int(model.raw.jnt_bodyid[joint]))
            if model.joint_kinds[joint] not in {"hinge", "slide"}:
                raise InputError(
                    f"joint {joint_name(model, joint)} must be a hinge or a slide, got "
                    f"{model.joint_kinds[joint]}; a hand's root alone may have a free joint"
                )
            for root in rooted:
                if model.raw.jnt_bodyid[root] not in path:
                    raise InputError(
                        f"joint {joint_name(model, root)} must move the whole hand, but does not "
                        f"move {joint_name(model, joint)}; remove what is not the hand's"
                    )
        servos = filed_servos(model, joints, stiffness_n_m_per_rad, own_servos=own_servos)
        return cls(model, tuple(joints), servos, rubbing, weld)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Return the names of the joints, as the file has them."""
        return tuple(joint_name(self.model, joint) for joint in self.joints)

    @property
    def ranges(self) -> Array:
        """Return the lowest and highest angles, infinite for none, (j, 2) [rad]."""
        found = self.model.joint_ranges[list(self.joints)]
        return np.where(np.isnan(found), (-np.inf, np.inf), found)

    @property
    def lever_m(self) -> float:
        """Return the root mean square distance of links from the hinges that move them [m]."""
        raw, model = self.model.raw, self.model
        squares = list[float]()
        for joint in self.joints:
            if model.joint_kinds[joint] == "slide":
                squares.append(SLIDE_LEVER_M**2)
                continue
            body = int(raw.jnt_bodyid[joint])
            axis = model.positions[body] + model.rotations[body] @ raw.jnt_pos[joint]
            squares += [
                float(((model.positions[other] - axis) ** 2).sum())
                for other in range(raw.nbody) if body in path_of_body(model, other)
            ]  # fmt: skip
        return max(LEAST_LEVER_M, float(np.sqrt(np.mean(squares))))

    @property
    def fingers(self) -> tuple[tuple[str, ...], ...]:
        """Return the names of the links of each finger: the branches behind the palm."""
        paths = [path_of_body(self.model, body) for body in range(self.model.raw.nbody)]
        moved = [path for path in paths if path[-1] in self._moved]
        tips = [path for path in moved if not any(path[-1] in other[:-1] for other in moved)]
        shared = set(tips[0]).intersection(*tips)
        depth = min(len(shared), *(len(path) - 1 for path in tips))
        return tuple(
            tuple(self.link_name(path[-1]) for path in paths if first in path)
            for first in dict.fromkeys(path[depth] for path in tips)
        )

    def joints_of(self, finger: int) -> list[int]:
        """Return which of the joints move a finger, or are coupled with those, by their places."""
        links = self.fingers[finger]
        found = {joint for joint in self.joints
                 if self.link_name(self.model.raw.jnt_bodyid[joint]) in links}  # fmt: skip
        for _ in self.joints:  # as long as a chain of couplings may be
            found |= {joint for rule in self.rules for joint in (rule.joint, rule.leader)
                      if found.intersection((rule.joint, rule.leader)) and joint >= 0}  # fmt: skip
        return [place for place, joint in enumerate(self.joints) if joint in found]

    def link_name(self, body: int) -> str:
        """Return the name of a body in a scene."""
        return OWN.format(self.model.body_names[body] or f"body{body}")

    def add_to(
        self, parts: Parts, parent: Element, _touching: Sequence[dict[str, Any]],
        contact: dict[str, Any],
    ) -> None:  # fmt: skip
        """Add the hand to a body, with a servo for each joint (see `Slides.add_to`)."""
        raw, carriers = self.model.raw, self._carriers
        if self.weld is None:
            root = add_element(parent, "body", {"name": ROOT_TOLD, "mocap": "true"})
        else:
            root = self.weld.add_to(parts, parent)
        bodies = {WORLD: add_element(root, "body", {"name": self.link_name(WORLD)})}
        if self.weld is not None and raw.body_mass[carriers == WORLD].max() < LEAST_KG:
            add_element(bodies[WORLD], "inertial", BARE_ROOT)
        for body in range(1, raw.nbody):
            own = {"name": self.link_name(body), "gravcomp": 1.0, "pos": raw.body_pos[body],
                   "quat": raw.body_quat[body]}  # fmt: skip
            bodies[body] = add_element(bodies[int(raw.body_parentid[body])], "body", own)
            for place, joint in enumerate(self.joints):
                if raw.jnt_bodyid[joint] == body:
                    add_element(bodies[body], "joint", self._joint(place))
            add_element(bodies[body], "inertial", {
                "pos": raw.body_ipos[body], "quat": raw.body_iquat[body],
                "mass": raw.body_mass[body], "diaginertia": raw.body_inertia[body],
            })  # fmt: skip
        for geom in self.shapes():
            self._add_shape(parts, bodies[int(raw.geom_bodyid[geom])], geom, contact)
        self._add_contact_rules(parts, contact)
        self._add_couplings(parts)
        self._add_servos(parts)

    def _add_servos(self, parts: Parts) -> None:
        servos = self.servos
        for place, name in enumerate(servos.names):
            most, span, pulled = servos.limits[place], servos.spans[place], servos.pulls[place]
            if name not in self.joint_names:
                tendon = add_element(parts["tendon"], "fixed", {"name": OWN.format(name)})
                for joint in np.flatnonzero(pulled).tolist():
                    named = OWN.format(self.joint_names[joint])
                    add_element(tendon, "joint", {"joint": named, "coef": pulled[joint]})
            add_servo(
                parts["actuator"], OWN.format(name), servos.stiffness[place],
                servos.damping[place], (-most, most) if np.isfinite(most) else None,
                tuple(span.tolist()) if np.isfinite(span).all() else None,
                pulls="joint" if name in self.joint_names else "tendon",
            )  # fmt: skip

    def following(self, angles: Array) -> tuple[Array, Array]:
        """Return the angles that obey the rules, (j,) [rad], and how they turn with free joints.

        Takes angles (j,) of which those of the m free joints count. Gives derivatives, (j, m).
        """
        places = {joint: place for place, joint in enumerate(self.joints)}
        waiting = {places[rule.joint]: rule for rule in self.rules}
        obeyed, turning = angles.copy(), np.eye(len(angles))
        turning[list(waiting)] = 0.0
        start = self.model.raw.qpos0[self.model.raw.jnt_qposadr]
        free = [place for place in places.values() if place not in waiting]
        while waiting:
            ready = [place for place, rule in waiting.items()
                     if places.get(rule.leader, -1) not in waiting]  # fmt: skip
            if not ready:  # a circle of rules, which the simulator solves as it can
                break
            for place in ready:
                rule, powers = waiting[place], np.polynomial.Polynomial(waiting[place].powers)
                leader = places.get(rule.leader)
                turn = 0.0 if leader is None else obeyed[leader] - start[rule.leader]
                obeyed[place] = start[rule.joint] + powers(turn)
                if leader is not None:
                    turning[place] = powers.deriv()(turn) * turning[leader]
                del waiting[place]
        return obeyed, turning[:, free]

    def motors(self, levers: Array, angles: Array, unknown_n_m: float) -> Motors:
        """Return what motors exert for contact forces: rows of levers (j, 3k), at angles (j,).

        With the turns dq = R dy of joints and P of motors, R' L f = (P R)' F gives the motors'
        torques F. Where a tendon turns joints that are free, what is left of it asks contact forces
        for a balance between them, as a motor of no strength.
        """
        _, turning = self.following(angles)
        carried, pulled = turning.T @ levers, (self.servos.pulls @ turning).T
        limits = np.where(np.isfinite(self.servos.limits), self.servos.limits, unknown_n_m)
        missing = len(pulled) - pulled.shape[1]
        if missing == 0:
            own: Array = np.asarray(np.linalg.solve(pulled, carried), dtype=np.float64)
            return Motors(own, limits, np.zeros(len(limits)))
        balances = np.linalg.svd(pulled)[0][:, pulled.shape[1] :].T
        rows = np.vstack([np.linalg.pinv(pulled) @ carried, balances @ carried])
        return Motors(rows, np.append(limits, np.full(missing, BALANCED_N_M)), np.zeros(len(rows)))

    @property
    def _moved(self) -> set[int]:
        """Return the bodies that have joints."""
        return set(self.model.raw.jnt_bodyid[list(self.joints)].tolist())

    @property
    def _carriers(self) -> Indices:
        """Return for each body the last one on the way to it that has a joint; else the world."""
        model, moved = self.model, self._moved
        paths = (path_of_body(model, body) for body in range(model.raw.nbody))
        return np.array([max(moved.intersection(path), default=WORLD) for path in paths])

    def _joint(self, place: int) -> dict[str, object]:
        raw, joint = self.model.raw, self.joints[place]
        slides = self.model.joint_kinds[joint] == "slide"
        inertia = self.armature_kg_m2 * (SLIDE_LEVER_M**-2 if slides else 1.0)
        dof = raw.jnt_dofadr[joint]
        limited = self.stops and bool(raw.jnt_limited[joint])
        return {
            "name": OWN.format(joint_name(self.model, joint)),
            "type": self.model.joint_kinds[joint],
            "pos": raw.jnt_pos[joint], "axis": raw.jnt_axis[joint],
            "ref": raw.qpos0[raw.jnt_qposadr[joint]],
            "limited": "true" if limited else "false",
            "range": raw.jnt_range[joint] if limited else (0.0, 0.0),
            "solreflimit": raw.jnt_solref[joint], "solimplimit": raw.jnt_solimp[joint],
            "margin": raw.jnt_margin[joint],
            "armature": raw.dof_armature[dof] + inertia,
            "frictionloss": raw.dof_frictionloss[dof],
            # dampers and springs may have further powers, which are left out
            "damping": raw.dof_damping[dof, ...].ravel()[0],
            "stiffness": raw.jnt_stiffness[joint, ...].ravel()[0],
            "springref": raw.qpos_spring[raw.jnt_qposadr[joint]],
        }  # fmt: skip

    def _add_shape(self, parts: Parts, own: Element, geom: int, contact: dict[str, Any]) -> None:
        raw, kind = self.model.raw, self.model.geom_kinds[geom]
        meets, met = (int(bits) & ~OBJECT_BIT if self.meets_itself else 0
                      for bits in self.model.geom_bits[geom])  # fmt: skip
        name = f"hand_shape{geom}"
        shape = {"name": name, "type": kind, "contype": meets, "conaffinity": met | OBJECT_BIT,
                 "mass": 0.0, "group": 2, "rgba": (0.62, 0.66, 0.72, 1.0), "friction": self.rubbing,
                 "pos": raw.geom_pos[geom], "quat": raw.geom_quat[geom]}  # fmt: skip
        if kind == "mesh":
            solid = {"name": name, "inertia": "shell", "vertex": _hull(self.model, geom)}
            add_element(parts["asset"], "mesh", solid)
            shape["mesh"] = name
        else:
            shape["size"] = raw.geom_size[geom]
        add_element(own, "geom", shape | contact)

    def shapes(self) -> list[int]:
        """Return the shapes that collide, or are named in pairs that do."""
        raw, bits = self.model.raw, self.model.geom_bits
        paired = {*raw.pair_geom1.tolist(), *raw.pair_geom2.tolist()}
        return [
            geom for geom, kind in enumerate(self.model.geom_kinds)
            if kind not in NO_SOLIDS and (bits[geom].any() or geom in paired)
        ]  # fmt: skip

    def _add_contact_rules(self, parts: Parts, contact: dict[str, Any]) -> None:
        """Add which links may not meet, and which shapes must."""
        raw, shapes, carriers = self.model.raw, set(self.shapes()), self._carriers
        apart = {(both >> 16, both & 0xFFFF) for both in raw.exclude_signature.tolist()}
        still, above = carriers == WORLD, carriers[raw.body_parentid[carriers]]
        for body in np.flatnonzero(~still & (above == WORLD)).tolist():  # neighbours of the root
            apart |= {(other, body) for other in np.flatnonzero(still).tolist()}
        for one, other in sorted(apart):
            named = {"body1": self.link_name(one), "body2": self.link_name(other)}
            add_element(parts["contact"], "exclude", named)
        for pair in zip(raw.pair_geom1.tolist(), raw.pair_geom2.tolist(), strict=True):
            if shapes.issuperset(pair) and self.meets_itself:
                named = {f"geom{end}": f"hand_shape{geom}" for end, geom in enumerate(pair, 1)}
                add_element(parts["contact"], "pair", named | contact)

    @property
    def rules(self) -> tuple[JointRule, ...]:
        """Return the rules that hold joints at functions of others, or at an angle."""
        kept = {*self.joints, -1}
        return tuple(rule for rule in self.model.joint_rules
                     if kept.issuperset((rule.joint, rule.leader)))  # fmt: skip

    def _add_couplings(self, parts: Parts) -> None:
        """Add which joints follow others, or stand at an angle."""
        for rule in self.rules:
            named = {
                f"joint{place}": OWN.format(joint_name(self.model, joint))
                for place, joint in enumerate((rule.joint, rule.leader), 1)
                if joint >= 0
            }
            solref, solimp = rule.hardness
            hard = {"solref": solref, "solimp": solimp}
            if rule.hardness == USUAL_HARDNESS:  # the file states none
                hard = TIED
            add_element(parts["equality"], "joint", named | {"polycoef": rule.powers} | hard)


def _hull(model: HandModel, geom: int) -> Array:
    """Return the corners of the hull that MuJoCo has made of a mesh, (n, 3) [m]."""
    raw, mesh = model.raw, model.raw.geom_dataid[geom]
    graph = raw.mesh_graph[raw.mesh_graphadr[mesh] :]  # counts, then two numbers for each corner
    return mesh_points(model, geom)[graph[2 + graph[0] : 2 + 2 * graph[0]]]
