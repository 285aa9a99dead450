"""A grasp and its negative controls, from analysis through simulation to a verdict.

For each test wrench the analysis predicts the largest multiple that is resisted. A share of it is
applied in simulation, with forces between those at rest and those at the limit. The critical
friction is found in simulation too, and on request the limits. The grasp is confirmed when all
wrenches hold. The run can be trusted when the simulator is faithful (`gate`) and no control holds.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, TypeAlias

import numpy as np

from grasp_core.checked import coefficient, function, instance, several, whole
from grasp_core.errors import InputError, UndecidedError
from grasp_core.objects.on_faces import check_body, check_on_faces
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Grasp
from scenes.mujoco.fingertips import clashes
from sim_validate.closure.controls import ControlVerdict, negative_controls, try_control
from sim_validate.closure.noise import for_repeats, robustness
from sim_validate.closure.verdict import Scale, Verdict, WrenchVerdict
from sim_validate.engine.bench import Bench
from sim_validate.engine.gate import (
    Gate,
    measured_gate,
    remember_gate,
    require_faithful,
    require_touch,
)
from sim_validate.engine.limits import (
    CriticalFriction,
    SimulatedLimit,
    bisected_limits,
    ramped_limits,
    released_friction,
)
from sim_validate.engine.loads import PlannedLoad, planned_loads
from sim_validate.engine.rig import Rig, squeezed
from sim_validate.engine.setup import Agenda, Setup
from sim_validate.engine.traces import judge
from sim_validate.kit.processes import Shared, each, processes


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
    check_on_faces(body, grasp)
    coefficient(friction)
    agenda, setup = asked_for(agenda, setup)
    critical = setup.critical_friction(grasp)
    closed = friction > critical
    if not (closed and setup.closure(grasp, friction).closed):
        raise InputError(
            f"grasp {grasp.id}: force closure needs friction above {critical:.6g}, got {friction}"
        )
    gate = require_faithful(setup, friction, body.radius)
    return tested(body, replace(grasp, critical_friction=critical), friction, gate, agenda, setup)


def tested(
    body: Polyhedron, grasp: Grasp, friction: float, gate: Gate | None, agenda: Agenda, setup: Setup
) -> Verdict:
    """Test a grasp whose closure is proved, with a simulator that was checked before."""
    require_touch(body, grasp.contacts, setup)
    scene = setup.scene(body, grasp, friction)
    bench = Bench(scene, threads=setup.threads, timeout_s=setup.timeout_s)
    rig = squeezed(bench, setup, scene.layout.squeeze_forces, friction)
    loads = planned_loads(body, grasp.contacts, friction, rig.idle, agenda, setup)
    overlap = clashes(body, grasp.positions, grasp.normals, scene.layout.drive.radius_m)
    wrenches = held_wrenches(rig, loads, agenda, overlap)
    critical = CriticalFriction(grasp.critical_friction)
    if agenda.critical_friction:
        with suppress(UndecidedError):
            critical = released_friction(
                bench, grasp.positions, grasp.normals, critical.predicted, setup
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
        scale=Scale.of(scene.layout, body.radius),
        gate=gate,
        scene=scene,
    )


def held_wrenches(
    rig: Rig, loads: Sequence[PlannedLoad], agenda: Agenda, overlap: Sequence[str] = ()
) -> tuple[WrenchVerdict, ...]:
    """Judge the hold of every load and, if asked for, find its limit.

    What fingertips overlap at the start, if anything, is given in words.
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
            judge(trace, rig.bench.scene.layout, rig.setup.hold, overlap),
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
    _, setup = asked_for(None, setup)
    predicted = setup.critical_friction(grasp)
    if not np.isfinite(predicted):
        raise InputError(f"grasp {grasp.id}: no friction gives force closure; choose another grasp")
    friction = max(predicted, setup.friction.least_friction)
    require_faithful(setup, radius_m=body.radius)
    require_touch(body, grasp.contacts, setup)
    scene = setup.scene(body, grasp, friction)
    bench = Bench(scene, threads=setup.threads, timeout_s=setup.timeout_s)
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
    """One grasp to validate, as it is sent to a worker process."""

    body: Polyhedron
    grasp: Grasp
    friction: float
    agenda: Agenda
    setup: Setup
    gate: Gate | None = None
    """How the simulator did on the known cases, so that worker processes need not ask again."""

    def __reduce__(self) -> tuple[Callable[..., "Job"], tuple[object, ...]]:
        """Send the object so that all grasps of a worker process have the same one."""
        rest = (self.grasp, self.friction, self.agenda, self.setup, self.gate)
        return _arrived, (Shared(self.body), *rest)


def _arrived(body: Shared[Polyhedron], *rest: Any) -> Job:
    return Job(body.value, *rest)


def validated(jobs: Sequence[Job], processors: int) -> Iterator[Verdict]:
    """Yield one verdict per job, in order; the number of processors does not change the results."""
    count = processes(len(jobs), processors)
    return each(verdict_of, prepared(jobs, processors), jobs=count)


def prepared(jobs: Sequence[Job], processors: int) -> list[Job]:
    """Check the simulator for each job, and give each an equal share of processors that remain."""
    threads = max(1, processors // processes(len(jobs), processors))
    return [
        replace(
            job, setup=replace(job.setup, threads=threads),
            gate=measured_gate(job.setup, job.friction, job.body.radius),
        )
        for job in jobs
    ]  # fmt: skip


def verdict_of(job: Job) -> Verdict:
    """Validate one grasp."""
    if job.gate is not None:
        remember_gate(job.gate, job.setup, job.friction, job.body.radius)
    return validate(job.body, job.grasp, job.friction, agenda=job.agenda, setup=job.setup)


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
        One verdict per grasp, in order.

    Raises:
        InputError: A grasp is not on the body's faces, or not closed at this friction.
        UnfaithfulError: The simulator fails its checks with these settings.
    """
    check_body(body)
    coefficient(friction)
    kind = partial(instance, kind=Grasp, name="grasps")
    listed = several(grasps, kind, "grasps", "Grasp values")
    agenda, setup = asked_for(agenda, setup)
    whole(jobs, "jobs", least=1)
    if progress is not None:
        function(progress, "progress")
    tasks = [Job(body, grasp, friction, agenda, setup) for grasp in listed]
    verdicts: list[Verdict] = []
    for verdict in validated(tasks, jobs) if jobs > 1 else map(verdict_of, tasks):
        verdicts.append(verdict)
        if progress is not None:
            progress(len(verdicts), len(tasks), verdict)
    return tuple(verdicts)
