"""Executes grasps: chooses a squeeze, runs all its trials in one batch, and judges them.

The squeeze is chosen once: the one that carries the most of the object's weight in any direction
with the largest push allowed. Every trial then runs with it. Before, the simulator is checked on
cases whose answers are known (see `held_cases`). Several grasps of an object are executed in one
process or in several.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Annotated, Any

import numpy as np
from annotated_types import Interval
from numpy.typing import ArrayLike

from grasp_core.allowed_values import instance, value_of
from grasp_core.closure.contacts import contacts_sha256, listed_contacts
from grasp_core.errors import NoForcesError
from grasp_core.execution.squeeze_certificate import BestSqueeze
from grasp_core.objects.on_faces import check_body, check_on_faces, edge_distance, face_under
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact, Grasp
from scenes.mujoco_options import PhysicsSettings
from sim_validate.engine.kept_gates import checked
from sim_validate.engine.setup import MOST_THREADS
from sim_validate.execution.confirming import confirmed_trials, run_trials, with_first_slips
from sim_validate.execution.enough import NoSqueezeError, found_enough
from sim_validate.execution.held_cases import cases_of
from sim_validate.execution.holders import Holder, SpringFingers, planned
from sim_validate.execution.simulate import HeldBench
from sim_validate.execution.trials import run_controls
from sim_validate.execution.verdict import ExecutedGrasp, Execution
from sim_validate.processes.own_faults import OWN_FAULTS
from sim_validate.processes.workers import each, processes
from sim_validate.settings import ExecutionSettings

OUT_OF_REACH = 3.0
"""How far an object is from its place when its trial ends, in its radii: no finger reaches it."""


def execute(
    body: Polyhedron,
    grasp: Grasp | Iterable[Contact],
    friction: ArrayLike,
    settings: ExecutionSettings | None = None,
    *,
    threads: int = 1,
    physics: PhysicsSettings | None = None,
    enough: bool = True,
) -> Execution:
    """Simulate a grasp as a robot would execute it, and predict the outcome.

    Args:
        body: The object.
        grasp: A grasp, or contacts, at least two.
        friction: Coulomb coefficient, one for all contacts or one each.
        settings: Mass, springs, trials and thresholds; the usual ones if None, with the mass of
            water.
        threads: Number of the simulator's threads; results do not depend on it.
        physics: Settings of the simulator; None for those that suit springs and masses. Gravity
            must be that of the settings.
        enough: Whether to find the push that would be enough where the object is lost or has no
            squeeze (see `Execution.enough`), which takes up to a second.

    Raises:
        InputError: A number is out of range.
        NoForcesError: No squeeze carries the weight, or the grip is unstable under the best one.
        UnfaithfulError: The simulator fails on a case with a known answer.
    """
    contacts = given_contacts(body, grasp)
    asked = ExecutionSettings() if settings is None else settings
    instance(asked, ExecutionSettings, "settings")
    if physics is not None:
        instance(physics, PhysicsSettings, "physics")
    fingers = SpringFingers(body, contacts, friction, physics)
    return execution_of(fingers, asked.for_body(body), threads=threads, enough=enough)


def execution_of(
    holder: Holder, settings: ExecutionSettings, *, threads: int, enough: bool
) -> Execution:
    """Execute a grasp with what holds the object: fingertips, or a hand."""
    value_of(Annotated[int, Interval(ge=1, le=MOST_THREADS)], threads, "threads")
    value_of(bool, enough, "enough")
    best = _chosen_squeeze(holder, settings, enough=enough)
    scene, dynamics, trials, skipped = planned(holder, settings, best)
    for case in cases_of(scene.layout, scene.physics, settings, settings.push_n):
        checked(case)
    predicted = dict(zip(trials, dynamics.losses(trials, settings), strict=True))
    lost_m = max(OUT_OF_REACH * holder.body.radius, 2.0 * settings.most_m)
    bench = HeldBench(scene, threads=threads, lost_m=lost_m)
    motions = run_trials(bench, trials)
    judged = confirmed_trials(bench, motions, predicted, settings)
    found = Execution(
        mass_kg=settings.object_kg,
        squeeze=best.grip.squeeze,
        load_multiple=best.scale,
        trials=with_first_slips(bench, motions, judged),
        controls=run_controls(bench, best, dynamics.lowest_frequency),
        skipped=skipped,
        physics=scene.physics,
        tip_radius_m=best.grip.tip_radius_m,
        over_edges=over_edges(bench, holder.body),
    )
    if found.survived or not trials or not enough:
        return found
    return replace(found, enough=found_enough(holder, settings))


def _chosen_squeeze(holder: Holder, settings: ExecutionSettings, *, enough: bool) -> BestSqueeze:
    """Choose the squeeze; where there is none, find what would be enough, if that is wanted."""
    try:
        return holder.squeeze(settings)
    except NoForcesError as error:
        if not enough:
            raise
        raise NoSqueezeError(str(error), found_enough(holder, settings)) from error


def over_edges(bench: HeldBench, body: Polyhedron) -> tuple[int, ...]:
    """Return contacts nearer to an edge than the dent of their squeezed fingertip is wide.

    A sphere of radius r at depth d in a plane has a dent of radius sqrt(2 r d - d^2) there.
    """
    layout = bench.scene.layout
    joints = bench.squeezed[bench.parts["qpos"]]
    _, depths = bench.touched(layout.holder.tip_names, joints, one=False)
    dents = np.sqrt(np.maximum(depths * (2.0 * layout.tip_radius_m - depths), 0.0))
    found = list[int]()
    for finger, dent in enumerate(dents.tolist()):
        point = layout.contacts[finger] + body.center_of_mass
        face = face_under(body, Contact(point, layout.frames[finger, :, 0]))
        # a curved surface goes on beyond its patches
        if face is not None and not len(face.facets) and edge_distance(face, point) < dent:
            found.append(finger)
    return tuple(found)


def given_contacts(body: Polyhedron, grasp: Grasp | Iterable[Contact]) -> tuple[Contact, ...]:
    """Return the contacts of a grasp, or those that are given, checked."""
    check_body(body)
    if not isinstance(grasp, Grasp):
        return listed_contacts(grasp, "grasp")
    check_on_faces(body, grasp)
    return grasp.contacts


@dataclass(frozen=True, slots=True)
class ExecutionJob:
    """One grasp to execute, as it is sent to a worker process."""

    body: Polyhedron
    grasp: Grasp
    friction: float
    settings: ExecutionSettings
    physics: Mapping[str, Any] = field(default_factory=dict[str, Any])
    """Settings of the simulator that differ from the usual ones, by name."""
    threads: int = 1
    enough: bool = True

    @property
    def holder(self) -> SpringFingers:
        """The fingertips that execute it."""
        return SpringFingers(self.body, self.grasp.contacts, self.friction, self.physics)


def executed(jobs: Sequence[ExecutionJob], processors: int) -> Iterator[ExecutedGrasp]:
    """Yield one result per job, in order; the number of processors does not change the results."""
    count = processes(len(jobs), processors)
    threads = max(1, processors // count)
    work = partial(executed_grasp, refused=OWN_FAULTS)
    return each(work, [replace(job, threads=threads) for job in jobs], jobs=count)


def executed_grasp(
    job: ExecutionJob, refused: tuple[type[Exception], ...] = (NoForcesError,)
) -> ExecutedGrasp:
    """Execute one grasp; what is refused, such as one without a squeeze, is one with a reason."""
    grasp = job.grasp

    def found() -> Execution:
        check_on_faces(job.body, grasp)
        return execution_of(job.holder, job.settings, threads=job.threads, enough=job.enough)

    return result_of(grasp.id, grasp.family, grasp.contacts, found, refused)


def result_of(
    name: str, family: str, contacts: Sequence[Contact], execution: Callable[[], Execution],
    refused: tuple[type[Exception], ...],
) -> ExecutedGrasp:  # fmt: skip
    """Execute contacts; what is refused is a result with a reason."""
    about = name, family, contacts_sha256(contacts)
    try:
        return ExecutedGrasp(*about, execution())
    except refused as error:
        return ExecutedGrasp(*about, None, str(error), getattr(error, "enough", None))
