"""Compiles the text of a hand with MuJoCo and hands out plain arrays.

Links on fixed joints are kept, because their names are those of fingertips. Of a link only its mass
and centre of mass are used: inertias that no body can have are replaced, and links without a mass
are given one that counts as none, as MuJoCo compiles no others.
"""

# pyright: basic, reportAttributeAccessIssue=false
# MuJoCo ships no types for its core.

import math
import warnings
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.errors import InputError
from scenes.hand_files.model_text import ModelText, note
from scenes.silent_mujoco import mujoco, unlogged

NO_MASS_KG, NO_INERTIA_KG_M2 = 1e-12, 1e-14
"""Mass and inertia up to which there are none; MuJoCo compiles no joint that moves less than
1e-15."""
EVERY_BIT = 2**31 - 1
"""Bits of geoms that are made to collide with all others."""
TIED = 2
"""Number of joints that a tendon of a constant length ties to each other."""
POWERS = 5
"""Coefficients of the polynomials that hold joints: the constant, and the powers one to four."""


USUAL_HARDNESS = (0.02, 1.0), (0.9, 0.95, 0.001, 0.5, 2.0)
"""The `solref` and `solimp` of a rule that states none."""


class JointRule(NamedTuple):
    """A joint that is held at the angle `offset + ratio * angle of the leader`."""

    joint: int
    leader: int  # the other joint; -1 for a constant angle
    offset: float
    ratio: float
    powers: tuple[float, ...] = ()
    """Coefficients of the turn from the reference angle, by powers of the leader's, (5,)."""
    hardness: tuple[tuple[float, ...], tuple[float, ...]] = USUAL_HARDNESS
    """MJCF's `solref` and `solimp`."""

    @property
    def is_linear(self) -> bool:
        """Whether there are no further powers of the leader's angle."""
        return not any(self.powers[2:])


class Tendon(NamedTuple):
    """A tendon: a sum of joint angles, or a cable."""

    name: str
    joints: tuple[int, ...]  # joints of the sum; none for a cable
    factors: tuple[float, ...]  # what their angles are multiplied with
    motors: tuple[int, ...]  # the motors that pull it
    is_held: bool  # whether its length is a constant, or a function of another's
    lengths: tuple[float, float] | None = None  # least and largest; None for no limits


class HandModel(NamedTuple):
    """What a compiled model says: n bodies, j joints, g geoms."""

    raw: Any  # MuJoCo's own model, whose arrays are read where they are used
    body_names: tuple[str, ...]
    geom_names: tuple[str, ...]
    site_names: tuple[str, ...]
    joint_names: tuple[str, ...]
    positions: Array  # of bodies in the world at the reference angles, (n, 3) [m]
    rotations: Array  # their axes, (n, 3, 3)
    joint_kinds: tuple[str, ...]  # `hinge`, `slide`, `ball` or `free`
    joint_ranges: Array  # lowest and highest angles, NaN for none, (j, 2) [rad]
    references: Array  # angles of hinges as drawn, NaN for others, (j,) [rad]
    torques: Array  # largest torques, NaN where none is stated, (j,) [N m]
    geom_kinds: tuple[str, ...]
    geom_rotations: Array  # their axes, (g, 3, 3)
    geom_bits: Indices  # what a geom collides with: its type and affinity, (g, 2)
    joint_rules: tuple[JointRule, ...]  # what holds joints at functions of others
    loops: tuple[tuple[str, int, int], ...]  # how two bodies are held together, and which
    tendons: tuple[Tendon, ...]
    notes: tuple[str, ...]  # sentences about what was compiled otherwise


def compiled_hand(text: ModelText, *, lending: bool = True) -> HandModel:
    """Compile a hand's text.

    Bodies without shapes that collide do so with all they have; unless `lending`, only where no
    body of the file has shapes that collide.
    """
    try:
        with unlogged(), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about materials and the like
            mujoco.mj_clearCache(mujoco.mj_getCache())  # of other hands' files with the same names
            spec = mujoco.MjSpec.from_string(text.xml, assets=dict(text.files))
            odd = _replaced(spec)
            compiler = spec.compiler
            compiler.fusestatic, compiler.balanceinertia = False, True
            compiler.boundmass = max(compiler.boundmass, NO_MASS_KG)
            compiler.boundinertia = max(compiler.boundinertia, NO_INERTIA_KG_M2)
            model, notes = _without_unread(spec, text)
    except (ValueError, RuntimeError, mujoco.FatalError) as error:
        said = " ".join(str(error).split())[:300]
        raise InputError(f"MuJoCo cannot compile the file: {said}") from error
    data = mujoco.MjData(model)
    data.qpos[:] = model.qpos0
    mujoco.mj_kinematics(model, data)
    turns = np.empty((model.ngeom, 9))
    for quaternion, matrix in zip(model.geom_quat, turns, strict=True):
        mujoco.mju_quat2Mat(matrix, quaternion)
    bits = np.column_stack([model.geom_contype, model.geom_conaffinity]).astype(np.int64)
    lent = _lent(model, bits) if lending or not bits.any() else []
    bits[np.isin(model.geom_bodyid, lent)] = EVERY_BIT
    kinds = tuple(mujoco.mjtJoint(int(kind)).name[6:].lower() for kind in model.jnt_type)
    hinges = model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE
    moving = hinges | (model.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE)
    limited = moving & model.jnt_limited.astype(bool)
    return HandModel(
        raw=model,
        body_names=_names(model, mujoco.mjtObj.mjOBJ_BODY, model.nbody),
        geom_names=_names(model, mujoco.mjtObj.mjOBJ_GEOM, model.ngeom),
        site_names=_names(model, mujoco.mjtObj.mjOBJ_SITE, model.nsite),
        joint_names=_names(model, mujoco.mjtObj.mjOBJ_JOINT, model.njnt),
        positions=np.array(data.xpos),
        rotations=np.array(data.xmat).reshape(-1, 3, 3),
        joint_kinds=kinds,
        joint_ranges=np.where(limited[:, None], model.jnt_range, np.nan),
        references=np.where(hinges, model.qpos0[model.jnt_qposadr], np.nan),
        torques=_torques(model),
        geom_kinds=tuple(mujoco.mjtGeom(int(kind)).name[7:].lower() for kind in model.geom_type),
        geom_rotations=turns.reshape(-1, 3, 3),
        geom_bits=bits,
        joint_rules=(*_joint_rules(model), *_tendon_rules(model)),
        loops=_loops(model),
        tendons=_tendons(model),
        notes=(
            *notes,
            *note("inertias that no body can have count by their masses alone", odd),
            *note(
                "bodies without shapes that collide do so with all they have",
                [model.body(body).name for body in lent],
            ),
        ),
    )


def _lent(model: mujoco.MjModel, bits: Indices) -> list[int]:
    """Return the bodies of which no geom collides with anything, though they have some."""
    moving = set(model.geom_bodyid[bits.any(axis=1)].tolist())
    shown = model.geom_bodyid[model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE]
    marks = np.flatnonzero(model.body_mocapid >= 0).tolist()
    return sorted(set(shown.tolist()) - moving - {0, *marks})


def _without_unread(spec: mujoco.MjSpec, text: ModelText) -> tuple[mujoco.MjModel, tuple[str, ...]]:
    """Compile a model without meshes that only show and cannot be read; return it with notes.

    Shapes that neither collide nor give a body its mass only show. Where no shape of the file
    collides, all of them will.
    """
    solid = [geom for geom in spec.geoms if geom.type != mujoco.mjtGeom.mjGEOM_PLANE]
    colliding = [geom for geom in solid if geom.contype or geom.conaffinity]
    used = {geom.meshname for geom in colliding or solid}
    always = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    for body in spec.bodies[1:]:  # the first is the world
        if not body.explicitinertial or int(spec.compiler.inertiafromgeom) == int(always):
            used |= {geom.meshname for geom in body.geoms if geom.density and geom.mass != 0.0}
    for mesh in spec.meshes:
        if mesh.name in used and mesh.file in text.unread:
            raise InputError(text.unread[mesh.file])
    shown = {mesh.name: mesh.file for mesh in spec.meshes if mesh.name not in used}
    notes = _delete_meshes(spec, {name for name, file in shown.items() if file in text.unread})
    try:
        return spec.compile(), notes
    except ValueError:
        left = {name: file for name, file in shown.items() if file not in text.unread}
        broken = {name for name, file in left.items() if not _is_mesh(file, text.files[file])}
        notes = (*notes, *_delete_meshes(spec, broken))
        return spec.compile(), notes


def _delete_meshes(spec: mujoco.MjSpec, names: set[str]) -> tuple[str, ...]:
    """Delete meshes and their geoms; return notes."""
    geoms = [geom for geom in spec.geoms if geom.meshname in names]
    bodies = {geom.parent.name: geom.parent for geom in geoms if geom.parent.name != "world"}
    for element in [*geoms, *(mesh for mesh in spec.meshes if mesh.name in names)]:
        spec.delete(element)
    bare = [name or "?" for name, body in bodies.items() if not body.geoms]
    return (
        *note("meshes that only show and cannot be read are left out", sorted(names)),
        *note("bodies that have only such meshes touch nothing", bare),
    )


def _is_mesh(file: str, content: bytes) -> bool:
    """Return whether MuJoCo compiles a body that has a mesh alone."""
    spec = mujoco.MjSpec()
    spec.assets = {file: content}
    spec.add_mesh(name="mesh", file=file)
    spec.worldbody.add_body().add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="mesh")
    try:
        spec.compile()
    except ValueError:
        return False
    return True


def _replaced(spec: mujoco.MjSpec) -> list[str]:
    """Replace stated inertias that are not positive or violate A + B >= C; return whose they are.

    Links without a mass may have any: nothing of them counts.
    """
    found = list[str]()
    for body in spec.bodies:
        if body.mass < 0.0:
            raise InputError(
                f"the mass of {body.name or '?'} must not be negative, got {body.mass:.6g}; give "
                "its mass, or 0 for a link that is only a frame"
            )
        xx, yy, zz, xy, xz, yz = body.fullinertia.tolist()
        if math.isfinite(xx):
            own = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        else:
            own = np.sort(body.inertia)
        if not body.explicitinertial or (own[0] > 0.0 and own[0] + own[1] >= own[2]):
            continue
        if body.mass > 0.0:
            found.append(body.name or "?")
        body.fullinertia, body.inertia = [math.nan] * 6, [NO_INERTIA_KG_M2] * 3
    return found


def _joint_rules(model: mujoco.MjModel) -> Iterator[JointRule]:
    for i in _active(model, mujoco.mjtEq.mjEQ_JOINT):
        ends = int(model.eq_obj1id[i]), int(model.eq_obj2id[i])
        yield _rule(model, i, *ends, model.eq_data[i, :POWERS])


def _tendon_rules(model: mujoco.MjModel) -> Iterator[JointRule]:
    """Yield a rule for each tendon of two joints whose length is held: c_1 q_1 + c_2 q_2 = l."""
    for i in _active(model, mujoco.mjtEq.mjEQ_TENDON):
        joints, factors = _sum_of(model, int(model.eq_obj1id[i]))
        if len(joints) == TIED and model.eq_obj2id[i] < 0:
            one, other = factors
            powers = np.array([model.eq_data[i, 0] / one, -other / one, 0.0, 0.0, 0.0])
            yield _rule(model, i, *joints, powers)


def _rule(
    model: mujoco.MjModel, equality: int, joint: int, leader: int, powers: Array
) -> JointRule:
    start = model.qpos0[model.jnt_qposadr]
    constant, ratio = powers[:2].tolist()
    if leader < 0:
        ratio, powers = 0.0, powers * (1.0, 0.0, 0.0, 0.0, 0.0)
    offset = float(start[joint]) + constant - ratio * float(start[leader])
    hardness = tuple(model.eq_solref[equality].tolist()), tuple(model.eq_solimp[equality].tolist())
    return JointRule(joint, leader, offset, ratio, tuple(powers.tolist()), hardness)


def _sum_of(model: mujoco.MjModel, tendon: int) -> tuple[tuple[int, ...], tuple[float, ...]]:
    """Return the joints of a tendon that is a sum of angles, and their factors; none of a cable."""
    parts = slice(model.tendon_adr[tendon], model.tendon_adr[tendon] + model.tendon_num[tendon])
    sums = model.wrap_type[parts] == mujoco.mjtWrap.mjWRAP_JOINT
    joints, factors = model.wrap_objid[parts][sums], model.wrap_prm[parts][sums]
    return tuple(joints.tolist()), tuple(factors.tolist())


def _loops(model: mujoco.MjModel) -> tuple[tuple[str, int, int], ...]:
    found = list[tuple[str, int, int]]()
    kinds = {"connect": mujoco.mjtEq.mjEQ_CONNECT, "weld": mujoco.mjtEq.mjEQ_WELD}
    for name, kind in kinds.items():
        for i in _active(model, kind):
            ends = int(model.eq_obj1id[i]), int(model.eq_obj2id[i])
            if model.eq_objtype[i] == mujoco.mjtObj.mjOBJ_SITE:
                ends = int(model.site_bodyid[ends[0]]), int(model.site_bodyid[ends[1]])
            found.append((name, *ends))
    return tuple(found)


def _tendons(model: mujoco.MjModel) -> tuple[Tendon, ...]:
    names = _names(model, mujoco.mjtObj.mjOBJ_TENDON, model.ntendon)
    held = dict[int, int]()  # and the other tendon, -1 for none
    for i in _active(model, mujoco.mjtEq.mjEQ_TENDON):
        one, other = int(model.eq_obj1id[i]), int(model.eq_obj2id[i])
        held |= {one: other, other: one}
    pulling, found = model.actuator_trntype == mujoco.mjtTrn.mjTRN_TENDON, list[Tendon]()
    for i, name in enumerate(names):
        joints, factors = _sum_of(model, i)
        motors = np.flatnonzero(pulling & (model.actuator_trnid[:, 0] == i)).tolist()
        if not (held.get(i, 0) < 0 and len(joints) == TIED):  # else it is a rule of its joints
            low, high = model.tendon_range[i].tolist()
            lengths = (low, high) if model.tendon_limited[i] else None
            found.append(
                Tendon(name or f"tendon{i}", joints, factors, tuple(motors), i in held, lengths)
            )
    return tuple(found)


def _active(model: mujoco.MjModel, kind: mujoco.mjtEq) -> list[int]:
    return np.flatnonzero((model.eq_type == kind) & model.eq_active0.astype(bool)).tolist()


def _names(model: mujoco.MjModel, kind: mujoco.mjtObj, count: int) -> tuple[str, ...]:
    return tuple(mujoco.mj_id2name(model, kind, i) or "" for i in range(count))


def mesh_points(model: HandModel, geom: int) -> Array:
    """Return the corners of a geom that is a mesh, in its frame, (v, 3) [m]; none of others."""
    raw = model.raw
    if raw.geom_type[geom] != mujoco.mjtGeom.mjGEOM_MESH:
        return np.empty((0, 3))
    mesh = raw.geom_dataid[geom]
    first = int(raw.mesh_vertadr[mesh])
    return np.array(raw.mesh_vert[first : first + int(raw.mesh_vertnum[mesh])], float)


def _torques(model: mujoco.MjModel) -> Array:
    """Return the smallest torque that limits each joint: its own, or that of its motors."""
    found = np.full(model.njnt, np.inf)
    own = model.jnt_actfrclimited.astype(bool)
    found[own] = np.abs(model.jnt_actfrcrange[own]).max(axis=1)
    for i in range(model.nu):
        driven = model.actuator_trntype[i] == mujoco.mjtTrn.mjTRN_JOINT
        gear = abs(float(model.actuator_gear[i, 0]))
        if driven and model.actuator_forcelimited[i] and gear > 0.0:
            joint = int(model.actuator_trnid[i, 0])
            limit = gear * float(np.abs(model.actuator_forcerange[i]).max())
            found[joint] = min(found[joint], limit)
    return np.where(np.isfinite(found) & (found > 0.0), found, np.nan)
