"""A grasp and its negative controls, from analysis through simulation to a verdict.

For each test wrench the analysis predicts the largest multiple that is resisted. A share of it is
applied in simulation, with forces between those at rest and those at the limit. The critical
friction is found in simulation too, and on request the limits. The grasp is confirmed when all
wrenches hold. The run can be trusted when the simulator is faithful (`gate`) and no control holds.

On request the trials are repeated with seeded noise, to count how often the grasp still holds.
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
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, TypeAlias

import numpy as np

from grasp_core.arrays import Array
from grasp_core.closure.contacts import contact_frames, stacked
from grasp_core.errors import InputError, UndecidedError
from grasp_core.kinds import Count, Friction, function, instance, several, value_of
from grasp_core.objects.on_faces import check_body, check_on_faces, edge_distance, within
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.given_contacts import facets_of
from grasp_core.values import Contact, Grasp
from scenes.mujoco.closure_scene import Scene
from scenes.mujoco.fingertips import clashes
from sim_validate.closure.controls import Control, ControlVerdict, negative_controls, try_control
from sim_validate.closure.verdict import (
    AGREEMENT,
    NoisyTrial,
    Robustness,
    Scale,
    Verdict,
    WrenchVerdict,
)
from sim_validate.engine.gate import Gate, measured_gate, misplaced, require_faithful, require_touch
from sim_validate.engine.limits_and_friction import (
    Analysis,
    CriticalFriction,
    PlannedLoad,
    Rig,
    SimulatedLimit,
    bisected_limits,
    closed_on,
    ramped_limits,
    released_friction,
)
from sim_validate.engine.setup import WEAKEST, Agenda, Setup
from sim_validate.engine.simulate import Bench
from sim_validate.engine.traces import LET_GO, HoldVerdict, Outcome, judge, rotated
from sim_validate.processes.own_faults import OWN_FAULTS
from sim_validate.processes.workers import each, processes
from sim_validate.settings import Noise


def validate(
    body: Polyhedron,
    grasp: Grasp,
    friction: float = 0.5,
    *,
    agenda: Agenda | None = None,
    setup: Setup | None = None,
) -> Verdict:
    """Test a grasp and its negative controls in simulation.

    Args:
        body: The object.
        grasp: A grasp in force closure at this friction.
        friction: Coulomb coefficient at every contact.
        agenda: Which trials to run; the default agenda if None.
        setup: How trials are simulated; the default setup if None.

    Raises:
        InputError: The contacts are not on the body's faces, or not closed at this friction.
        UnfaithfulError: The simulator fails its checks with these settings.
    """
    return Job(body, friction, *asked_for(agenda, setup))(grasp)


NOT_STARTED: dict[str, Any] = {"critical_friction": False, "limits": "none", "repeats": 0}
"""Trials that a grasp is spared whose fingertips do not stand where they are planned."""


def tested(
    body: Polyhedron, grasp: Grasp, friction: float, gate: Gate | None, agenda: Agenda, setup: Setup
) -> Verdict:
    """Test a grasp whose closure is proved, with a simulator that was checked before."""
    scene = setup.scene(body, grasp, friction)
    layout, rig = scene.layout, closed_on(scene, setup, friction)
    loads = Analysis(body, grasp.contacts, friction, setup, None).planned(rig.idle, agenda)
    amiss = clashes(body, grasp.positions, grasp.normals, layout.drive.radius_m)
    untouched = () if amiss else untouching(rig.bench, body, grasp)
    if untouched:  # nothing that starts like this says anything about the grasp
        agenda = replace(agenda, **NOT_STARTED)
    wrenches = held_wrenches(rig, loads, agenda, amiss or untouched)
    critical = CriticalFriction(grasp.critical_friction)
    if agenda.critical_friction:
        with suppress(UndecidedError):
            critical = released_friction(
                rig.bench, grasp.positions, grasp.normals, critical.predicted, setup
            )
    controls, repeats = tuple[ControlVerdict, ...](), None
    if agenda.controls:
        made = negative_controls(body, grasp, friction, agenda.seed, setup)
        controls = tuple(try_control(body, each, agenda, setup) for each in made)
    if agenda.repeats:  # the same fingertips hold the same wrenches
        named = [(planned.name, planned.load.wrench) for planned in loads]
        repeats = robustness(body, grasp, friction, named, agenda, for_repeats(setup, scene))
    return Verdict(
        id=grasp.id,
        contacts=grasp.contacts,
        friction=friction,
        critical_friction=critical,
        wrenches=wrenches,
        controls=controls,
        robustness=repeats,
        setup=setup,
        agenda=agenda,
        scale=_scale(body, scene),
        gate=gate,
        scene=scene,
    )


def untouching(bench: Bench[Scene], body: Polyhedron, grasp: Grasp) -> tuple[str, ...]:
    """List the fingertips of a grasp that do not touch their faces at the start."""
    faces = zip(grasp.faces, grasp.positions, strict=True)
    return misplaced(bench, [edge_distance(body.faces[face], point) for face, point in faces])


def _scale(body: Polyhedron, scene: Scene) -> Scale:
    at = scene.layout
    return Scale(at.grasp_size_m, body.radius, at.object_kg, at.inertia_kg_m2, at.drive)


def held_wrenches(
    rig: Rig, loads: Sequence[PlannedLoad], agenda: Agenda, amiss: Sequence[str] = ()
) -> tuple[WrenchVerdict, ...]:
    """Judge the hold of every load, and find its limit if asked for.

    What is `amiss` with the start, in words, makes all of them invalid.
    """
    limits = [planned.limit for planned in loads]
    traces = rig.hold([planned.load for planned in loads])
    found: Sequence[SimulatedLimit | None] = [None] * len(limits)
    if agenda.limits != "none":
        search = ramped_limits if agenda.limits == "ramp" else bisected_limits
        found = search(rig, limits)
    return tuple(
        WrenchVerdict(
            each.name, each.load.wrench, each.predicted_limit, each.required_friction,
            judge(trace, rig.bench.scene.layout, rig.setup.hold, amiss),
            limit, trace if agenda.keep_traces else None,
        )
        for each, trace, limit in zip(loads, traces, found, strict=True)
    )  # fmt: skip


def simulated_critical_friction(
    body: Polyhedron, grasp: Grasp, setup: Setup | None = None
) -> float:
    """Find the smallest friction at which a squeezed object stays in place in simulation.

    Args:
        body: The object.
        grasp: A grasp on the faces of `body`.
        setup: How trials are simulated; the default setup if None.

    Returns:
        The friction; zero if less than `FrictionProtocol.least_friction` is enough; infinity
        if it was not found within the widest of `FrictionProtocol.spans` around the prediction.

    Raises:
        InputError: The contacts are not on the body's faces, or never in force closure.
        UnfaithfulError: The simulator fails its checks with these settings.
    """
    check_on_faces(body, grasp)
    setup = asked_for(None, setup)[1].for_body(body)
    predicted = setup.critical_friction(grasp)
    if not np.isfinite(predicted):
        raise InputError(f"grasp {grasp.id}: no friction gives force closure; choose another grasp")
    friction = max(predicted, setup.friction.least_friction)
    require_faithful(setup, radius_m=body.radius)
    scene = setup.scene(body, grasp, friction)
    bench = Bench(scene, threads=setup.threads, timeout_s=setup.timeout_s)
    require_touch(bench)
    found = released_friction(bench, grasp.positions, grasp.normals, predicted, setup)
    return np.inf if found.simulated is None else found.simulated


def asked_for(agenda: Agenda | None, setup: Setup | None) -> tuple[Agenda, Setup]:
    """Check which trials are asked for and how they are simulated; None stands for the defaults."""
    return (
        Agenda() if agenda is None else instance(agenda, Agenda, "agenda"),
        Setup() if setup is None else instance(setup, Setup, "setup"),
    )


Progress: TypeAlias = Callable[[int, int, Verdict], object]
"""Function that is told the number of grasps done, the number of all, and the last verdict."""


@dataclass(frozen=True, slots=True)
class Job:
    """How grasps of one object are validated: what is sent once to each worker process."""

    body: Polyhedron
    friction: float
    agenda: Agenda
    setup: Setup
    gate: Gate | None = None
    """How the simulator did on the known cases, so that worker processes need not ask again."""

    def prepared(self, count: int, processors: int) -> "Job":
        """Check the simulator, and give each of some grasps an equal share of the processors."""
        threads = max(1, processors // processes(count, processors))
        gate = measured_gate(self.setup.for_body(self.body), self.friction, self.body.radius)
        return replace(self, setup=replace(self.setup, threads=threads), gate=gate)

    def __call__(self, grasp: Grasp) -> Verdict:
        """Validate one grasp."""
        body, friction = self.body, self.friction
        check_on_faces(body, grasp)
        setup = self.setup.for_body(body)
        value_of(Friction, friction, "friction")
        critical = setup.critical_friction(grasp)
        closed = friction > critical
        if not (closed and setup.closure(grasp, friction).closed):
            raise InputError(
                f"grasp {grasp.id}: force closure needs friction above {critical:.6g}, got "
                f"{friction}"
            )
        gate = self.gate or measured_gate(setup, friction, body.radius)
        gate.require("no grasp is certified")
        if self.agenda.repeats:  # their contacts lean, on pads
            on_pads = measured_gate(replace(setup, surface="pads"), friction, body.radius)
            on_pads.require("no grasp is repeated with noise")
        proved = replace(grasp, critical_friction=critical)
        return tested(body, proved, friction, gate, self.agenda, setup)

    def attempted(self, grasp: Grasp) -> Verdict:
        """Validate one of several grasps; the reason why it cannot be is a verdict, too."""
        try:
            return self(grasp)
        except OWN_FAULTS as error:
            reason = str(error)
        setup = self.setup.for_body(self.body)
        scene = setup.scene(self.body, grasp, self.friction)  # refuses what suits no grasp
        nothing = np.full(len(grasp.contacts), np.nan)
        hold = HoldVerdict(Outcome.ERROR, reason, np.nan, np.nan, np.nan, nothing, None)
        return Verdict(
            id=grasp.id,
            contacts=grasp.contacts,
            friction=self.friction,
            critical_friction=CriticalFriction(grasp.critical_friction),
            wrenches=(WrenchVerdict(WEAKEST, np.zeros(6), 0.0, np.inf, hold),),
            controls=(),
            robustness=None,
            setup=setup,
            agenda=replace(self.agenda, controls=False, **NOT_STARTED),
            scale=_scale(self.body, scene),
            gate=self.gate,
            scene=scene,
        )


def validated(job: Job, grasps: Sequence[Grasp], processors: int) -> Iterator[Verdict]:
    """Yield one verdict per grasp, in order; the number of processors does not change results."""
    count = len(grasps)
    return each(
        job.prepared(count, processors).attempted, grasps, jobs=processes(count, processors)
    )


def validate_all(
    body: Polyhedron,
    grasps: Iterable[Grasp],
    friction: float = 0.5,
    *,
    agenda: Agenda | None = None,
    setup: Setup | None = None,
    jobs: int = 1,
    progress: Progress | None = None,
) -> tuple[Verdict, ...]:
    """Test many grasps of one object in simulation, each as `validate` does.

    Args:
        body: The object.
        grasps: Grasps in force closure at this friction, such as a plan.
        friction: Coulomb coefficient at every contact.
        agenda: Which trials to run; the default agenda if None.
        setup: How trials are simulated; the default setup if None.
        jobs: Largest number of processors to use; results do not depend on it. From 16 grasps on
            they are used as processes.
        progress: Called after each grasp, in order, with the number of grasps done, the number of
            all, and the verdict. What it raises ends the loop.

    Returns:
        One verdict per grasp, in order. A grasp that cannot be tested, such as one that is not on
        the body's faces or not closed at this friction, has the outcome `error` with the reason.

    Raises:
        InputError: An argument is out of range, or suits no grasp of this object.
        UnfaithfulError: The simulator fails its checks with these settings.
    """
    check_body(body)
    value_of(Friction, friction, "friction")
    kind = partial(instance, kind=Grasp, name="grasps")
    listed = several(grasps, kind, "grasps", "Grasp values")
    agenda, setup = asked_for(agenda, setup)
    value_of(Count, jobs, "jobs")
    if progress is not None:
        function(progress, "progress")
    job = Job(body, friction, agenda, setup)
    verdicts: list[Verdict] = []
    for verdict in validated(job, listed, jobs) if jobs > 1 else map(job.attempted, listed):
        verdicts.append(verdict)
        if progress is not None:
            progress(len(verdicts), len(listed), verdict)
    return tuple(verdicts)


STREAM = 1
"""Number of the random stream of noise, apart from other draws with the same seed."""


@dataclass(frozen=True, slots=True, eq=False)
class Disturbed:
    """A grasp after one draw of noise: `contacts` are `landed` with normals that lean."""

    landed: tuple[Contact, ...]
    """Where fingers meet the surface, with the model's normals; fewer than k contacts if some
    miss."""
    contacts: tuple[Contact, ...]
    missed: tuple[int, ...]
    friction: float
    mass: float  # mass of the trial, relative to the planned mass


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
    facets = facets_of(body)
    corners, normals = facets.corners, facets.normals
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
    rig, planned = noisy_case(body, case, loads, setup)
    overlap = clashes(body, *stacked(case.landed), rig.bench.scene.layout.drive.radius_m)
    verdicts = held_wrenches(rig, planned, Agenda(), overlap)
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


def noisy_case(
    body: Polyhedron, case: Disturbed, loads: Sequence[NamedLoad], setup: Setup
) -> tuple[Rig, tuple[PlannedLoad, ...]]:
    """Close fingers on the contacts of a repeat, and plan forces for its loads."""
    planned = setup.scene(body, case.contacts, case.friction)
    scene = planned.changed(
        object_kg=case.mass * planned.layout.object_kg,
        inertia_kg_m2=case.mass * planned.layout.inertia_kg_m2,
    )
    rig = closed_on(scene, setup, case.friction)
    heavy = [(name, case.mass * wrench) for name, wrench in loads]
    analysis = Analysis(body, case.contacts, case.friction, setup, None)
    return rig, analysis.as_they_are(rig.idle, heavy)
