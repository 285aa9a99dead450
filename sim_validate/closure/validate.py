"""A grasp and its negative controls, from analysis through simulation to a verdict.

For each test wrench the analysis predicts the largest multiple that is resisted. A share of it is
applied in simulation, with forces between those at rest and those at the limit. The critical
friction is found in simulation too, and on request the limits. The grasp is confirmed when all
wrenches hold. The run can be trusted when the simulator is faithful (`known_cases`) and no control
holds.

On request the trials are repeated with seeded noise, to count how often the grasp still holds.
The fingers come along their planned lines, but the object is displaced (see `misplacement`). Where
they touch, the surface normal leans a little from that of the model. Friction is the same at all
contacts; mass scales the simulated mass and every load; both are multiplied by the exponential of a
drawn number. Loads turn with the object. Every grasp gets the same draws.

The analysis says which loads the disturbed grasp resists, and simulation applies them all with
forces planned for the disturbed contacts. So a repeat asks whether the grasp can still hold, not
whether fingers notice the change. Contacts that noise takes out of force closure are tested as a
negative control: they must let go. Analysis and simulation must agree in every repeat. The share
that holds has a confidence interval.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any, TypeAlias

import numpy as np

from grasp_core.allowed_values import Count, Friction, function, instance, several, value_of
from grasp_core.arrays import Array
from grasp_core.closure.contacts import stacked
from grasp_core.errors import InputError, UndecidedError, UnfaithfulError
from grasp_core.objects.on_faces import check_body, check_on_faces, edge_distance
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Grasp
from scenes.mujoco.closure_scene import Scene
from scenes.mujoco.fingertip_room import clashes
from sim_validate.closure.controls import (
    LOW_FRICTION,
    Control,
    ControlVerdict,
    negative_controls,
    try_control,
)
from sim_validate.closure.verdict import (
    AGREEMENT,
    NoisyTrial,
    Robustness,
    TrialScale,
    Verdict,
    WrenchVerdict,
)
from sim_validate.engine.closure_cases import ClosureCase
from sim_validate.engine.held_or_let_go import LET_GO, HoldVerdict, Outcome, judge
from sim_validate.engine.kept_gates import checked
from sim_validate.engine.known_cases import Gate, untouching
from sim_validate.engine.misplacement import Disturbed, disturbed
from sim_validate.engine.planned_loads import LoadPlanner, PlannedLoad
from sim_validate.engine.rig import Rig, closed_on
from sim_validate.engine.setup import WEAKEST, Agenda, Setup
from sim_validate.engine.simulated_friction import CriticalFriction, released_friction
from sim_validate.engine.simulated_limits import SimulatedLimit, bisected_limits, ramped_limits
from sim_validate.engine.stepping import Bench
from sim_validate.processes.own_faults import OWN_FAULTS
from sim_validate.processes.workers import each, processes
from sim_validate.settings import USUAL_FRICTION


def validate(
    body: Polyhedron,
    grasp: Grasp,
    friction: float = USUAL_FRICTION,
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
    agenda, setup = with_defaults(agenda, setup)
    proved = proved_closed(body, grasp, friction, setup)
    setup = setup.for_body(body)
    gate = checked_for(body, friction, agenda, setup)
    return tested(body, proved, friction, gate, agenda, setup)


def with_defaults(agenda: Agenda | None, setup: Setup | None) -> tuple[Agenda, Setup]:
    """Check which trials are asked for and how they are simulated; None stands for the defaults."""
    return (
        Agenda() if agenda is None else instance(agenda, Agenda, "agenda"),
        Setup() if setup is None else instance(setup, Setup, "setup"),
    )


def proved_closed(body: Polyhedron, grasp: Grasp, friction: float, setup: Setup) -> Grasp:
    """Prove that a grasp is closed on its faces; return it with its own critical friction."""
    check_on_faces(body, grasp)
    value_of(Friction, friction, "friction")
    critical = setup.critical_friction(grasp)
    if not (friction > critical and setup.closure(grasp, friction).closed):
        raise InputError(
            f"grasp {grasp.id}: force closure needs friction above {critical:.6g}, got {friction}"
        )
    return replace(grasp, critical_friction=critical)


def checked_for(body: Polyhedron, friction: float, agenda: Agenda, setup: Setup) -> Gate:
    """Check the simulator on known cases like the trials of an agenda."""
    if agenda.repeats:  # their contacts lean, on pads
        checked(ClosureCase.of(replace(setup, surface="pads"), friction, body.radius))
    return checked(ClosureCase.of(setup.for_body(body), friction, body.radius))


NOT_STARTED: dict[str, Any] = {"critical_friction": False, "limits": "none", "repeats": 0}
"""Trials that a grasp is spared whose fingertips do not stand where they are planned."""


def tested(
    body: Polyhedron, grasp: Grasp, friction: float, gate: Gate | None, agenda: Agenda, setup: Setup
) -> Verdict:
    """Test a grasp whose closure is proved, with a simulator that was checked before."""
    scene = setup.scene(body, grasp, friction)
    rig = closed_on(scene, setup, friction)
    loads = LoadPlanner(body, grasp.contacts, friction, setup, None).planned(rig.idle, agenda)
    amiss = clashes(body, grasp.positions, grasp.normals, scene.layout.drive.radius_m)
    if not amiss and (amiss := off_faces(rig.bench, body, grasp)):
        agenda = replace(agenda, **NOT_STARTED)  # nothing that starts like this says anything
    wrenches = held_wrenches(rig, loads, agenda, amiss)
    critical = CriticalFriction(grasp.critical_friction)
    if agenda.critical_friction:
        with suppress(UndecidedError):
            critical = released_friction(
                rig.bench, grasp.positions, grasp.normals, critical.predicted, setup
            )
    controls, repeats = tuple[ControlVerdict, ...](), None
    if agenda.controls:
        made = negative_controls(body, grasp, friction, agenda.seed, setup)
        # where no size is asked for, its fingertips at lower friction are the grasp's
        same = {LOW_FRICTION: rig.bench} if setup.fingers.fingertip_radius_m is None else {}
        controls = tuple(
            try_control(body, each, agenda, setup, same.get(each.name)) for each in made
        )
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
        scale=TrialScale.of(body, scene.layout),
        gate=gate,
        scene=scene,
    )


def off_faces(bench: Bench[Scene], body: Polyhedron, grasp: Grasp) -> tuple[str, ...]:
    """List the fingertips of a grasp that do not touch their faces at the start."""
    faces = zip(grasp.faces, grasp.positions, strict=True)
    return untouching(bench, [edge_distance(body.faces[face], point) for face, point in faces])


def held_wrenches(
    rig: Rig, loads: Sequence[PlannedLoad], agenda: Agenda, amiss: Sequence[str] = ()
) -> tuple[WrenchVerdict, ...]:
    """Judge the hold of every load, and find its limit if asked for.

    What is `amiss` with the start, in words, makes all of them invalid.
    """
    limits = [planned.limit for planned in loads]
    traces = rig.traced(rig.holds([planned.load for planned in loads]))
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
    setup = with_defaults(None, setup)[1].for_body(body)
    predicted = setup.critical_friction(grasp)
    if not np.isfinite(predicted):
        raise InputError(f"grasp {grasp.id}: no friction gives force closure; choose another grasp")
    friction = max(predicted, setup.friction.least_friction)
    checked(ClosureCase.of(setup, radius_m=body.radius))
    scene = setup.scene(body, grasp, friction)
    bench = Bench(scene, threads=setup.threads, timeout_s=setup.timeout_s)
    if amiss := untouching(bench):
        raise UnfaithfulError(amiss[0])
    found = released_friction(bench, grasp.positions, grasp.normals, predicted, setup)
    return np.inf if found.simulated is None else found.simulated


VerdictProgress: TypeAlias = Callable[[int, int, Verdict], object]
"""Function that is told the number of grasps done, the number of all, and the last verdict."""


def validate_all(
    body: Polyhedron,
    grasps: Iterable[Grasp],
    friction: float = USUAL_FRICTION,
    *,
    agenda: Agenda | None = None,
    setup: Setup | None = None,
    jobs: int = 1,
    progress: VerdictProgress | None = None,
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
    agenda, setup = with_defaults(agenda, setup)
    value_of(Count, jobs, "jobs")
    if progress is not None:
        function(progress, "progress")
    verdicts: list[Verdict] = []
    if not listed:
        return ()
    gate = checked_for(body, friction, agenda, setup)
    for verdict in validated(body, listed, friction, gate, agenda, setup, jobs):
        verdicts.append(verdict)
        if progress is not None:
            progress(len(verdicts), len(listed), verdict)
    return tuple(verdicts)


def validated(
    body: Polyhedron, grasps: Sequence[Grasp], friction: float, gate: Gate, agenda: Agenda,
    setup: Setup, jobs: int,
) -> Iterator[Verdict]:  # fmt: skip
    """Yield one verdict per grasp, in order; the number of processors does not change results."""
    count = processes(len(grasps), jobs)
    setup = replace(setup.for_body(body), threads=max(setup.threads, jobs // count))
    work = partial(validated_grasp, body, friction=friction, gate=gate, agenda=agenda, setup=setup)
    return each(work, grasps, jobs=count)


def validated_grasp(
    body: Polyhedron, grasp: Grasp, *, friction: float, gate: Gate, agenda: Agenda, setup: Setup,
    refused: tuple[type[Exception], ...] = OWN_FAULTS,
) -> Verdict:  # fmt: skip
    """Validate one of several grasps; if an error in `refused` says why not, that is its verdict.

    The simulator was checked before.
    """
    try:
        proved = proved_closed(body, grasp, friction, setup)
        return tested(body, proved, friction, gate, agenda, setup)
    except refused as error:
        reason = str(error)
    scene = setup.scene(body, grasp, friction)  # refuses what suits no grasp
    nothing = np.full(len(grasp.contacts), np.nan)
    hold = HoldVerdict(Outcome.ERROR, reason, np.nan, np.nan, np.nan, nothing, None)
    return Verdict(
        id=grasp.id,
        contacts=grasp.contacts,
        friction=friction,
        critical_friction=CriticalFriction(grasp.critical_friction),
        wrenches=(WrenchVerdict(WEAKEST, np.zeros(6), 0.0, np.inf, hold),),
        controls=(),
        robustness=None,
        setup=setup,
        agenda=replace(agenda, controls=False, **NOT_STARTED),
        scale=TrialScale.of(body, scene.layout),
        gate=gate,
        scene=scene,
    )


NamedLoad: TypeAlias = tuple[str, Array]
"""A name with a wrench, (6,) [N, N m], torque about the centre of mass."""
OPENED_BY_NOISE = "noise"


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
        control = Control(OPENED_BY_NOISE, case.friction, certificate)
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
    planner = LoadPlanner(body, case.contacts, case.friction, setup, None)
    return rig, planner.as_they_are(rig.idle, heavy)
