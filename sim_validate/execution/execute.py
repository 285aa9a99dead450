"""Executes grasps: chooses their squeezes, runs all trials of each in one batch, and judges them.

The squeeze is chosen once: the one that carries the most of the object's weight in any direction
with the largest push allowed. Every trial then runs with it. Before, the simulator is checked on
cases whose answers are known (see `gate`).

A trial that is lost is run again with short steps: a loss counts only if it does not depend on the
step. So is one whose object slips and is kept, but moves by more than `NEAR` of what is allowed:
then the motion with short steps counts. Where contacts open and close between fingertips that push
lightly, an object rattles. With steps of the usual length it bounces too much, and may fall where
it would come to rest. Up to the first contact that opens or slips, steps of that length are exact
enough, so a run with steps of `FINE_S` goes on from shortly before. It ends where the object is
farther than it may be: a loss is confirmed then, whatever comes later.

Several grasps of an object are executed in one process or in several, and their trials are filmed.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from annotated_types import Interval
from numpy.typing import ArrayLike

from grasp_core.arrays import Array
from grasp_core.closure.contacts import contact_arrays, contacts_sha256, listed_contacts, stacked
from grasp_core.errors import GraspError, InputError, NoForcesError
from grasp_core.execution.grips import Grip, unsqueezed
from grasp_core.execution.squeeze_certificate import BestSqueeze
from grasp_core.kinds import instance, one_of, value_of
from grasp_core.objects.on_faces import (
    check_body,
    check_on_faces,
    edge_distance,
    face_under,
)
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact, Grasp
from scenes.drawing.clips import RATE, write_held_clip
from scenes.mujoco.fingertip_room import fitting_radius
from scenes.mujoco.held_scene import SAMPLE_S, HeldScene, build_held_scene, held_physics
from scenes.mujoco_options import PhysicsSettings
from sim_validate.engine.known_cases import checked
from sim_validate.engine.setup import MOST_THREADS
from sim_validate.execution.gate import cases_of
from sim_validate.execution.paths import Drive
from sim_validate.execution.predictions import Holder, NoSqueezeError, found_enough, planned
from sim_validate.execution.simulate import (
    FULL,
    IDLE,
    HeldBench,
    HeldMotion,
    Outcome,
    cosines,
    first_trouble,
    outcome,
    sticking_multiple,
)
from sim_validate.execution.trials import Trial, run_controls
from sim_validate.execution.verdict import ExecutedGrasp, Execution, ExecutionTrial
from sim_validate.processes.own_faults import OWN_FAULTS
from sim_validate.processes.workers import each, processes
from sim_validate.settings import ExecutionSettings

FINE_S = 1.25e-4
"""Length of steps that confirm a loss, at most [s]."""
FINER = 4
"""Number of such steps in a step of the usual length, at least."""
NEAR = 0.5
"""Share of the motion allowed above which short steps find that of a kept object that slips."""
BEFORE = 4
"""Samples before the first trouble that is seen at which the second run begins: what happens within
a sample is not seen."""
SHORTEST_S = 1e-5
"""Shortest step that is taken [s]."""


def confirming_bench(bench: HeldBench) -> HeldBench | None:
    """Return a bench of the same scene with short steps; None if those of this one are as short."""
    count = _short_steps(bench)
    if count <= bench.chunk:
        return None
    return HeldBench(bench.scene, threads=bench.threads, step_s=bench.sample_s / count)


def _short_steps(bench: HeldBench) -> int:
    """Return how many short steps there are in a sample."""
    step_s = min(FINE_S, held_physics(bench.scene.layout).timestep / FINER)
    return round(bench.sample_s / max(step_s, SHORTEST_S))


def run_again(
    bench: HeldBench, motions: Mapping[Trial, HeldMotion], settings: ExecutionSettings
) -> dict[Trial, HeldMotion]:
    """Simulate trials with short steps from before their trouble on."""
    begins = [_begin(trial, motion) for trial, motion in motions.items()]
    drives, starts = list[Drive](), list[Array]()
    for (trial, motion), begin in zip(motions.items(), begins, strict=True):
        rest = trial.drive.rows(slice(begin + 1, None))
        # later states have the speed of a trial that starts to move when its weight has come
        velocity = rest.velocity if begin < trial.weighing else np.zeros(3)
        lost = _lost(motion, trial.begun, settings)
        drives.append(replace(rest, velocity=velocity, lost=lost))
        starts.append(motion.states[begin])
    rests = bench.run(drives, np.stack(starts))
    return {  # faults came later than what is kept of a first run
        trial: replace(motion.rows(slice(begin + 1)), health=rest.health).then(rest)
        for (trial, motion), begin, rest in zip(motions.items(), begins, rests, strict=True)
    }


def _begin(trial: Trial, motion: HeldMotion) -> int:
    """Return the sample after which a trial is run again, zero if nothing says when it slips."""
    layout = motion.layout
    pushing = np.linalg.norm(layout.pushes, axis=1) > IDLE * float(np.abs(layout.pushes).max())
    if (motion.forces[trial.begun, pushing] == 0.0).all(axis=1).any():
        return 0
    trouble = first_trouble(motion, layout.friction, trial.begun)
    return max(0, trouble - BEFORE) if trouble < len(motion.moved) else 0


def _lost(motion: HeldMotion, begun: int, settings: ExecutionSettings) -> tuple[float, float]:
    """Return how far from its planned place [m, rad] an object surely is lost."""
    (cosine,) = cosines(motion.turns[begun : begun + 1])
    angle = math.acos(min(max(float(cosine), -1.0), 1.0))
    away = float(np.linalg.norm(motion.shifts[begun]))
    return settings.most_m + away, settings.most_rad + angle


LOST = 3.0
"""How far an object is from its place when its trial ends, in its radii: no finger reaches it."""
STICKING = 20.0
"""Friction of contacts that stick, relative to the true one."""
DIVERGED = Outcome(math.inf, math.inf, math.inf, dropped=True, slipped=True, first_slip=0.0)
"""What is known of an object that the simulator cannot follow."""


def execute(
    body: Polyhedron,
    grasp: Grasp | Iterable[Contact],
    friction: ArrayLike,
    settings: ExecutionSettings | None = None,
    *,
    mass_kg: float | None = None,
    threads: int = 1,
    physics: PhysicsSettings | None = None,
    enough: bool = True,
) -> Execution:
    """Simulate a grasp as a robot would execute it, and predict the outcome.

    Args:
        body: The object.
        grasp: A grasp, or contacts, at least two.
        friction: Coulomb coefficient, one for all contacts or one each.
        settings: Mass, springs, trials and thresholds; None for the usual ones with `mass_kg`.
        mass_kg: Mass of the object, in place of that of the settings [kg].
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
    settings = asked_settings("execute", settings, mass_kg, ExecutionSettings)
    if physics is not None:
        instance(physics, PhysicsSettings, "physics")
    fingers = Fingertips(body, given_contacts(body, grasp), friction, physics)
    return execution_of(fingers, settings.for_body(body), threads=threads, enough=enough)


@dataclass(frozen=True, slots=True, eq=False)
class Fingertips(Holder):
    """Fingertips on springs, which hold an object by contacts."""

    contacts: Sequence[Contact]
    friction: ArrayLike
    physics: PhysicsSettings | Mapping[str, Any] | None = None
    """Settings of the simulator, or those of the usual ones that differ, by name; None for the
    usual ones."""

    def loose(self, settings: ExecutionSettings) -> tuple[Grip, None]:
        """Return the contacts before they are squeezed; no motors limit fingertips."""
        stiffness = settings.tip_stiffness_n_per_m
        radius = tip_radius(self.body, self.contacts, settings)
        return unsqueezed(
            self.body, self.contacts, self.friction, stiffness=stiffness, tip_radius_m=radius
        ), None

    def scene(self, settings: ExecutionSettings, best: BestSqueeze) -> HeldScene:
        """Build the scene in which a squeeze is executed."""
        build = partial(
            build_held_scene, self.body, best.grip, settings,
            reach_m=self.reach_m(settings, best.grip),
        )  # fmt: skip
        if not isinstance(self.physics, Mapping):
            return build(physics=self.physics)
        usual = build()
        return build(physics=replace(usual.physics, **self.physics)) if self.physics else usual


def asked_settings(
    by: str, settings: ExecutionSettings | None, mass_kg: float | None,
    usual: Callable[[float], ExecutionSettings],
) -> ExecutionSettings:  # fmt: skip
    """Return settings with a mass, if one is given, or the usual ones for the mass."""
    if settings is not None:
        instance(settings, ExecutionSettings, "settings")
        if mass_kg is None:
            return settings
        return replace(settings, mass_kg=mass_kg, density_kg_m3=None)
    if mass_kg is None:
        raise InputError(f"{by}: expected mass_kg or settings, got neither; give mass_kg=0.3")
    return usual(mass_kg)


def execution_of(
    holder: Holder, settings: ExecutionSettings, *, threads: int, enough: bool
) -> Execution:
    """Choose the squeeze, simulate its trials, and find what would be enough if they are lost."""
    value_of(Annotated[int, Interval(ge=1, le=MOST_THREADS)], threads, "threads")
    value_of(bool, enough, "enough")
    try:
        best = holder.squeeze(settings)
    except NoForcesError as error:
        if not enough:
            raise
        raise NoSqueezeError(str(error), found_enough(holder, settings)) from error
    found = simulated(holder, settings, best, threads)
    if found.survived or not found.trials or not enough:
        return found
    return replace(found, enough=found_enough(holder, settings))


def simulated(
    holder: Holder, settings: ExecutionSettings, best: BestSqueeze, threads: int
) -> Execution:
    """Simulate the trials of an execution with the squeeze that was chosen, and judge each."""
    scene, dynamics, trials, skipped = planned(holder, settings, best)
    for case in cases_of(scene.layout, scene.physics, settings, settings.push_n):
        checked(case)
    lost_m = max(LOST * holder.body.radius, 2.0 * settings.most_m)
    bench = HeldBench(scene, threads=threads, lost_m=lost_m)
    predicted = dict(zip(trials, dynamics.losses(trials, settings), strict=True))
    return Execution(
        mass_kg=settings.object_kg,
        squeeze=best.grip.squeeze,
        load_multiple=best.scale,
        trials=_with_first_slips(bench, _confirmed_trials(bench, predicted, settings)),
        controls=run_controls(bench, best, dynamics.lowest_frequency),
        skipped=skipped,
        physics=scene.physics,
        tip_radius_m=best.grip.tip_radius_m,
        over_edges=over_edges(bench, holder.body),
    )


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


def tip_radius(body: Polyhedron, contacts: Sequence[Contact], settings: ExecutionSettings) -> float:
    """Return the radius of the fingertips [m]: as in the settings, or one that fits."""
    if settings.tip_radius_m is not None:
        return settings.tip_radius_m
    return fitting_radius(body, *contact_arrays(*stacked(contacts)))


def run_trials(bench: HeldBench, trials: Sequence[Trial]) -> dict[Trial, HeldMotion]:
    """Simulate trials: some with open fingers, others from a squeezed object or its weight."""
    found = dict[Trial, HeldMotion]()
    if weighing := [trial for trial in trials if trial.weighing]:
        # The weight comes once for all. Hand and object get the speed that they start with when it
        # has come: uniform motion changes nothing.
        first = weighing[0].drive.rows(slice(weighing[0].weighing))
        weight, state = bench.settled(replace(first, velocity=np.zeros(3)), bench.squeezed)
        rests = [trial.drive.rows(slice(trial.weighing, None)) for trial in weighing]
        for trial, motion in zip(weighing, bench.run(rests, state), strict=True):
            health = motion.health.after(weight.health)
            found[trial] = replace(weight.then(motion), health=health)
    apart = [trial for trial in trials if trial.apart]
    others = [trial for trial in trials if not (trial.weighing or trial.apart)]
    for own, start in ((apart, None), (others, bench.squeezed)):
        if own:
            motions = bench.run([trial.drive for trial in own], start)
            found |= dict(zip(own, motions, strict=True))
    return {trial: found[trial] for trial in trials}


def _with_first_slips(
    bench: HeldBench, judged: Mapping[Trial, ExecutionTrial]
) -> tuple[ExecutionTrial, ...]:
    """Measure the first slip of loads that come at once, by contacts that stick."""
    known, friction = dict(judged), bench.scene.layout.friction
    rough = {
        replace(trial, drive=replace(trial.drive, friction=STICKING * friction)): trial
        for trial, each in judged.items()
        if each.fate in {"slipped", "dropped"}
        and (trial.weighing or each.kind == "lift" or each.simulated_first_slip >= FULL)
    }
    for trial, motion in (run_trials(bench, tuple(rough)) if rough else {}).items():
        multiple = sticking_multiple(motion, trial.drive, friction, trial.begun)
        sudden = rough[trial]
        known[sudden] = replace(known[sudden], simulated_first_slip=min(multiple, 1.0))
    return tuple(known.values())


def _confirmed_trials(
    bench: HeldBench, predicted: Mapping[Trial, tuple[float, float]], settings: ExecutionSettings
) -> dict[Trial, ExecutionTrial]:
    """Simulate trials and judge them; after a slip that loses the object, or nearly, once more."""
    motions = run_trials(bench, tuple(predicted))
    judged = {
        trial: _judged(trial, motion, predicted[trial], bench, settings)
        for trial, motion in motions.items()
    }
    again = {
        trial: motions[trial] for trial, each in judged.items()
        if each.fate != "stuck" and (not each.survived or _is_near(each, settings))
    }  # fmt: skip
    short = confirming_bench(bench) if again else None
    if short is not None:
        for trial, motion in run_again(short, again, settings).items():
            first, found = judged[trial], _judged(trial, motion, predicted[trial], short, settings)
            confirmed = not (found.survived or first.survived) and first.fate != "diverged"
            judged[trial] = replace(first, step_s=short.step_s) if confirmed else found
    return judged


def _is_near(trial: ExecutionTrial, settings: ExecutionSettings) -> bool:
    """Whether an object moved by more than `NEAR` of what is allowed."""
    moved, turned = trial.displacement_m, trial.turn_rad
    return moved > NEAR * settings.most_m or turned > NEAR * settings.most_rad


def _judged(
    trial: Trial, motion: HeldMotion, predicted: tuple[float, float], bench: HeldBench,
    settings: ExecutionSettings,
) -> ExecutionTrial:  # fmt: skip
    if motion.health.fault:
        found = DIVERGED
    else:
        found = outcome(motion, trial.drive, motion.layout.friction, trial.begun)
    moved = found.displacement_m > settings.most_m or found.turn_rad > settings.most_rad
    survived = not (moved or found.dropped)
    held = "slipped" if found.slipped else "stuck"
    lost = "diverged" if motion.health.fault else "dropped"
    return ExecutionTrial(
        kind=trial.kind,
        name=trial.name,
        survived=survived,
        fate=lost if found.dropped else held,
        slip_m=found.slip_m,
        displacement_m=found.displacement_m,
        turn_rad=found.turn_rad,
        predicted_first_slip=predicted[0],
        predicted_loss=predicted[1],
        simulated_first_slip=found.first_slip,
        step_s=bench.step_s,
        starts_closed=trial.starts_closed,
        converged=not found.slipped or (survived and bench.chunk >= _short_steps(bench)),
    )


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
    def holder(self) -> Fingertips:
        """The fingertips that execute it."""
        return Fingertips(self.body, self.grasp.contacts, self.friction, self.physics)


def executed(jobs: Sequence[ExecutionJob], processors: int) -> Iterator[ExecutedGrasp]:
    """Yield one result per job, in order; the number of processors does not change the results."""
    count = processes(len(jobs), processors)
    threads = max(1, processors // count)
    return each(attempted, [replace(job, threads=threads) for job in jobs], jobs=count)


def attempted(job: ExecutionJob) -> ExecutedGrasp:
    """Execute one of several grasps; whatever is wrong with it alone is a result with a reason."""
    try:
        return executed_grasp(job)
    except OWN_FAULTS as error:
        grasp = job.grasp
        about = grasp.id, grasp.family, contacts_sha256(grasp.contacts)
        return ExecutedGrasp(*about, None, str(error))


def executed_grasp(job: ExecutionJob) -> ExecutedGrasp:
    """Execute one grasp; a grasp without a squeeze is a result with a reason."""
    grasp = job.grasp

    def found() -> Execution:
        check_on_faces(job.body, grasp)
        return execution_of(job.holder, job.settings, threads=job.threads, enough=job.enough)

    return result_of(grasp.id, grasp.family, grasp.contacts, found)


def result_of(
    name: str, family: str, contacts: Sequence[Contact], execution: Callable[[], Execution],
    refused: tuple[type[GraspError], ...] = (NoForcesError,),
) -> ExecutedGrasp:  # fmt: skip
    """Execute contacts; what is refused is a result with a reason."""
    about = name, family, contacts_sha256(contacts)
    try:
        return ExecutedGrasp(*about, execution())
    except refused as error:
        return ExecutedGrasp(*about, None, str(error), getattr(error, "enough", None))


FRAMES = 60
"""Least number of frames of a clip, 2.4 s: shorter motions are slowed down by a whole number."""
VISIBLE_M = 1e-4
"""Least slip that is worth a clip, about a pixel of its picture [m]."""


def worth_seeing(found: Execution) -> tuple[ExecutionTrial, ...]:
    """Choose the trials to film: the lift, the worst shake, and the worst slip that can be seen."""
    shakes = sorted(
        found.of_kind("shake"),
        key=lambda each: (each.survived, each.simulated_first_slip, each.predicted_first_slip),
    )
    slips = [
        each for each in found.trials
        if each.dropped or (each.fate == "slipped" and each.slip_m >= VISIBLE_M)
    ]  # fmt: skip
    slips.sort(key=lambda each: (not each.dropped, -each.slip_m))
    chosen = [*found.of_kind("lift")[:1], *shakes[:1], *slips[:1]]
    return tuple({trial.name: trial for trial in chosen}.values())


def film(job: ExecutionJob, name: str, path: Path) -> Path:
    """Simulate one trial of an execution again and draw it."""
    best = job.holder.squeeze(job.settings)
    scene, _, trials, _ = planned(job.holder, job.settings, best)
    named = {trial.name: trial for trial in trials}
    one_of(name, tuple(named), "name")
    motion = run_trials(HeldBench(scene), [named[name]])[named[name]]
    stride = max(1, min(round(1.0 / (RATE * SAMPLE_S)), len(motion.joints) // FRAMES))
    slowed = 1.0 / (RATE * SAMPLE_S * stride)
    caption = name if slowed <= 1.0 else f"{name}, {slowed:.1f} times slower"
    table, gravity = named[name].drive.table, scene.layout.gravity
    up = -gravity / np.linalg.norm(gravity) if table is None else table.normal
    return write_held_clip(
        scene, motion.joints[::stride], path, caption, up=up,
        table=None if table is None else (table.point, table.quaternion),
    )  # fmt: skip
