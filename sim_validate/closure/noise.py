"""Repeats the trials of a grasp with seeded noise, and counts how often the grasp still holds.

The fingers come along their planned lines, but the object is displaced. Each finger touches where
its line enters the same face, if the line does (on a curved object, the surface near the planned
contact). There the surface normal leans a little from that of the model. Friction is the same at
all contacts; mass scales the simulated mass and every load. Loads turn with the object.

All noise is drawn from normal distributions; friction and mass are multiplied by the exponential of
the drawn number. The draws of a trial depend only on the seed and the trial's number. So every
grasp gets the same draws, and a larger deviation only scales them.

The analysis says which loads the disturbed grasp resists, and simulation applies them all with
forces planned for the disturbed contacts. So a repeat asks whether the grasp can still hold, not
whether fingers notice the change. Contacts that noise takes out of force closure are tested as a
negative control: they must let go. Analysis and simulation must agree in every repeat. The share
that holds has a confidence interval.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.contacts import contact_frames, stacked
from grasp_core.errors import UndecidedError
from grasp_core.objects.on_faces import within
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact, Grasp
from scenes.mujoco.closure_scene import Scene, to_text
from scenes.mujoco.fingertips import clashes
from sim_validate.closure.controls import Control, try_control
from sim_validate.closure.verdict import AGREEMENT, NoisyTrial, Robustness, WrenchVerdict
from sim_validate.engine.bench import Bench
from sim_validate.engine.loads import PlannedLoad, loads_as_they_are
from sim_validate.engine.rig import Rig, squeezed
from sim_validate.engine.setup import Agenda, Setup
from sim_validate.engine.traces import LET_GO, Outcome, judge, rotated
from sim_validate.settings.trials import Noise

STREAM = 1
"""Number of the random stream that noise is drawn from, apart from other draws with the same
seed."""


@dataclass(frozen=True, slots=True, eq=False)
class Disturbed:
    """A grasp after one draw of noise: `contacts` are `landed` with normals that lean."""

    landed: tuple[Contact, ...]
    """Where fingers meet the surface, with the model's normals; fewer than k contacts if some
    miss."""
    contacts: tuple[Contact, ...]
    missed: tuple[int, ...]
    friction: float
    mass: float
    """Mass of the trial, relative to the planned mass."""


def disturbed(
    body: Polyhedron, grasp: Grasp, friction: float, noise: Noise, seed: int, number: int
) -> Disturbed:
    """Disturb a grasp by the noise of one repeated trial."""
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(STREAM, number)))
    shift, turn = noise.shift * body.radius * rng.normal(size=3), rng.normal(size=3)
    slipperiness, heaviness = rng.normal(size=2)
    leaning = math.radians(noise.normal_deg) * rng.normal(size=(len(grasp.contacts), 2))
    # Turning the object is the same as turning the fingers' lines back.
    back = _quaternion(-math.radians(noise.turn_deg) * turn)
    center = body.center_of_mass
    points = rotated(back, grasp.positions - center - shift) + center
    ways = rotated(back, grasp.normals)
    found = [
        _landing(body, face, point, way)
        for face, point, way in zip(grasp.faces, points, ways, strict=True)
    ]
    return Disturbed(
        landed=tuple(contact for contact in found if contact is not None),
        contacts=tuple(
            Contact(contact.position, _leaning(contact.normal, lean))
            for contact, lean in zip(found, leaning, strict=True)
            if contact is not None
        ),
        missed=tuple(finger for finger, contact in enumerate(found) if contact is None),
        friction=friction * math.exp(noise.friction * slipperiness),
        mass=math.exp(noise.mass * heaviness),
    )


def _quaternion(rotation: Array) -> Array:
    """Convert a rotation vector [rad] into a unit quaternion wxyz, (4,)."""
    angle = float(np.linalg.norm(rotation))
    return np.append(math.cos(0.5 * angle), 0.5 * np.sinc(0.5 * angle / math.pi) * rotation)


def _leaning(normal: Array, lean: Array) -> Array:
    """Turn a normal about an axis in the surface, given by its tangential coordinates [rad]."""
    tangents = contact_frames(normal[None])[0, :, 1:]
    return rotated(_quaternion(tangents @ lean), normal)


def _landing(body: Polyhedron, face: int, point: Array, way: Array) -> Contact | None:
    """Find where a line enters a face, or a curved surface near a point; None if nowhere."""
    if body.patches is None:
        plane = body.faces[face]
        at = _crossing(plane.centroid[None], plane.normal[None], point, way)[0]
        inside = np.isfinite(at).all() and any(
            within(at, piece, plane.normal, 0.0) for piece in plane.pieces
        )
        return Contact(at, plane.normal) if inside else None
    corners = body.vertices[body.triangles[:, ::-1]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sizes = np.linalg.norm(normals, axis=1)
    corners, normals = corners[sizes > 0.0], (normals[sizes > 0.0].T / sizes[sizes > 0.0]).T
    at = _crossing(corners[:, 0], normals, point, way)
    edges = np.roll(corners, -1, axis=1) - corners
    beside = np.einsum("tei,tei->te", np.cross(normals[:, None], edges), at[:, None] - corners)
    hit = np.flatnonzero((beside >= 0.0).all(axis=1))
    if not hit.size:
        return None
    first = hit[np.linalg.norm(at[hit] - point, axis=1).argmin()]
    return Contact(at[first], normals[first])


def _crossing(points: Array, normals: Array, point: Array, way: Array) -> Array:
    """Find the points where a line enters each of n planes, (n, 3); NaN where it enters none."""
    falling = normals @ way
    entering = falling > 0.0
    share = np.einsum("ni,ni->n", normals, points - point) / np.where(entering, falling, np.nan)
    return point + share[:, None] * way


NamedLoad: TypeAlias = tuple[str, Array]
"""A name with a wrench, (6,) [N, N m], torque about the centre of mass."""
OPEN = "noise"
"""Name of the negative control made of contacts that noise took out of force closure."""


def robustness(
    body: Polyhedron, grasp: Grasp, friction: float, loads: Sequence[NamedLoad],
    agenda: Agenda, setup: Setup,
) -> Robustness:  # fmt: skip
    """Repeat the holds of a grasp with noise."""
    trials = list[NoisyTrial]()
    for number in range(agenda.repeats):
        case = disturbed(body, grasp, friction, agenda.noise, agenda.seed, number)
        trials.append(noisy_trial(body, case, loads, number, setup))
    return Robustness(agenda.noise, tuple(trials))


def for_repeats(setup: Setup, scene: Scene) -> Setup:
    """The setup for repeats: the undisturbed grasp's fingertips, on pads that may lean."""
    fingers = replace(setup.fingers, fingertip_radius_m=scene.layout.drive.radius_m)
    return replace(setup, fingers=fingers, surface="pads")


def noisy_trial(
    body: Polyhedron, case: Disturbed, loads: Sequence[NamedLoad], number: int, setup: Setup
) -> NoisyTrial:
    """Simulate one repeat: hold all loads, or let go if noise took the contacts out of closure."""
    if case.missed:
        reason = f"finger {case.missed[0]} misses its face"
        return NoisyTrial(number, False, Outcome.LOST_CONTACT, "", reason, ())
    try:
        certificate = setup.closure(case.contacts, case.friction)
    except UndecidedError as error:
        return NoisyTrial(number, None, Outcome.ERROR, "", str(error), ())
    if not certificate.closed:  # a negative control, which must let go
        control = Control(OPEN, case.friction, certificate)
        verdict = try_control(body, control, Agenda(), setup)
        if verdict.held:
            wrong = ("contacts that are proved not force-closed held the object",)
            return NoisyTrial(number, False, Outcome.HELD, "", "", wrong)
        name, hold = verdict.tried[0].name, verdict.tried[0].hold
        return NoisyTrial(number, False, hold.outcome, name, hold.reason, _silent(hold.outcome))
    verdicts = tuple(_held_loads(body, case, loads, setup))
    first = next((each for each in verdicts if each.hold.outcome is not Outcome.HELD), None)
    silent = () if first is None else _silent(first.hold.outcome)
    return NoisyTrial(
        number=number,
        predicted=all(each.predicted_limit >= 1.0 for each in verdicts),
        outcome=Outcome.HELD if first is None else first.hold.outcome,
        wrench="" if first is None else first.name,
        reason="" if first is None else first.hold.reason,
        contradictions=(*(each.contradiction for each in verdicts if each.contradiction), *silent),
        close=any(abs(each.predicted_limit - 1.0) <= AGREEMENT for each in verdicts),
    )


def _silent(outcome: Outcome) -> tuple[str, ...]:
    """Describe an outcome that decides nothing; fingertips without room are not reported."""
    says = (Outcome.HELD, *LET_GO, Outcome.INVALID_START)
    return () if outcome in says else (f"{outcome.value}: neither held nor let go",)


def _held_loads(
    body: Polyhedron, case: Disturbed, loads: Sequence[NamedLoad], setup: Setup
) -> Iterator[WrenchVerdict]:
    rig, planned = noisy_case(body, case, loads, setup)
    layout = rig.bench.scene.layout
    overlap = clashes(body, *stacked(case.landed), layout.drive.radius_m)
    for each, trace in zip(planned, rig.hold([one.load for one in planned]), strict=True):
        yield WrenchVerdict(
            each.name, each.load.wrench, each.predicted_limit, each.required_friction,
            judge(trace, layout, setup.hold, overlap),
        )  # fmt: skip


def noisy_case(
    body: Polyhedron, case: Disturbed, loads: Sequence[NamedLoad], setup: Setup
) -> tuple[Rig, tuple[PlannedLoad, ...]]:
    """Close fingers on the contacts of a repeat, and plan forces for its loads."""
    planned = setup.scene(body, case.contacts, case.friction)
    layout = replace(
        planned.layout,
        object_kg=case.mass * planned.layout.object_kg,
        inertia_kg_m2=case.mass * planned.layout.inertia_kg_m2,
    )
    text = to_text(layout, planned.physics, planned.surface)
    scene = replace(planned, xml=text, layout=layout)
    bench = Bench(scene, threads=setup.threads, timeout_s=setup.timeout_s)
    rig = squeezed(bench, setup, scene.layout.squeeze_forces, case.friction)
    heavy = [(name, case.mass * wrench) for name, wrench in loads]
    return rig, loads_as_they_are(body, case.contacts, case.friction, rig.idle, heavy, setup)
