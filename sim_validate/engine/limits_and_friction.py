"""Holds an object between squeezing fingers, and finds the largest wrenches and least friction.

Wrench holds, ramps and releases start from the squeezed object. The fingers squeeze while friction
is raised, so that the transients of loading cannot slip a contact that would hold at rest. In a
hold, the wrench and the forces planned for it are then applied together, the object settles,
friction is lowered to the value under test, and the object must stay where it is.

Largest wrenches are found by a ramp or by bisection, where the object moves by a threshold. The
mass must first be accelerated, so a ramp finds the limit late, never early. Both load the object
with a share of the predicted limit and the forces planned for it, which lie that share of the way
from the gentle squeeze to the forces at the limit. They balance the load, because both ends do.
Below the limit they are inside the cones and the limits on the push, again because both ends are.
Above it, up to twice the limit, the forces still balance on paper, but friction gives way, or a
finger cannot push harder.

A ramp passes the limit slowly. The load left over grows in proportion to the time since, so the
displacement grows with its third power and the ramp ends late. A displacement eight times as large
is reached when twice as much time has passed since the limit. Extrapolating the two times back
gives a bound from below.

For the critical friction, fingers squeeze with forces that balance at the predicted one, mu*, and
need it, and friction falls until the object slips. Above mu* these forces are inside their friction
cones. Below mu* there are no balanced forces with which all of these fingers push, so the object
must move. Where two fingers alone need mu*, the others must push as well: otherwise the object
turns about the line between the two far above mu*. Therefore the forces are planned for a friction
just above mu*, with the smallest push as large as possible.

An `Analysis` chooses the wrenches that a grasp is tested with, and plans finger forces for them.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from grasp_core.arrays import Array, Indices, cross, rounded, to_digits
from grasp_core.closure.contacts import (
    contact_frictions,
    contact_torsions,
    normal_and_tangential,
    stacked,
)
from grasp_core.declared import Declared, declared
from grasp_core.errors import NoForcesError, SolverError, UndecidedError
from grasp_core.kinds import OrInfinity
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.contact_forces import even_forces
from grasp_core.quality.motors import Motors
from grasp_core.quality.wrench_limits import (
    WrenchBody,
    WrenchLimit,
    axis_wrenches,
    limit_of,
    weakest_from,
)
from grasp_core.values import Contact
from scenes.mujoco.closure_scene import SQUEEZE, Layout, Scene
from scenes.settings import HARD, Softness
from sim_validate.engine.setup import AXIS_NAMES, RANDOM, WEAKEST, Agenda, Setup
from sim_validate.engine.simulate import Bench, Load, Motion, Schedule, samples, smooth
from sim_validate.engine.traces import EarlyEnds, Thresholds, Trace, holds, traces
from sim_validate.settings import FrictionProtocol


@dataclass(frozen=True, slots=True, eq=False)
class Watched:
    """The motion in one hold, from the closed fingers to the end."""

    joints: Array
    trace: Trace
    times_s: Array
    """Times of the samples, zero at the moment friction was lowered, (n,) [s]."""
    pushes_n: Array
    """Forces of the servos along the axes of the contacts, (n, k, 3) [N]."""
    friction: Array


@dataclass(frozen=True, slots=True, eq=False)
class Rig:
    """An object without load, squeezed by its fingers."""

    bench: Bench[Scene]
    setup: Setup
    friction: float
    """The friction at which the object is to be held."""
    idle: Load
    """The load without a wrench: only the forces that squeeze the object."""
    closed: Motion | None
    """The motion of the fingers while they closed; None for rigid fingers, which do not move."""
    settled: bool = False
    """Whether the object also settled in that motion, so that friction may be lowered at once."""
    whole: bool = False
    """Whether all trials have the protocols' full length; else each ends as soon as its answer is
    known (see `traces`)."""

    def hold(
        self, loads: Sequence[Load], settling_frictions: Sequence[float] | None = None
    ) -> tuple[Trace, ...]:
        """Simulate a hold under each load, and trace it from the moment friction is lowered."""
        protocol, size = self.setup.hold, self.bench.scene.layout.grasp_size_m
        limits = Thresholds(protocol.hold_threshold * size, protocol.total_threshold * size)
        return self._traces(self.holds(loads, settling_frictions), limits)

    def watch(self, load: Load, settling_frictions: Sequence[float] | None = None) -> Watched:
        """Simulate one whole hold, and keep all motion since the fingers closed."""
        (schedule,) = self.holds([load], settling_frictions)
        (motion,) = self._simulated([schedule])
        (found,) = self._traced([schedule], [motion])
        before = [] if self.closed is None else [self.closed.joints[-1:]]
        count = len(motion.joints)
        return Watched(
            joints=np.concatenate([*before, motion.joints]),
            trace=found,
            times_s=self.bench.sample_s
            * np.arange(1.0 - schedule.watched, count + 1.0 - schedule.watched),
            pushes_n=pushes(schedule.forces[:count], motion.joints, self.bench.scene.layout),
            friction=schedule.friction[:count],
        )

    def holds(
        self, loads: Sequence[Load], settling_frictions: Sequence[float] | None = None
    ) -> list[Schedule]:
        """Schedule a hold under each load."""
        protocol = self.setup.hold
        rise, rest, hold = self._counts(protocol.load_s, protocol.settle_s, protocol.hold_s)
        shares = np.concatenate([smooth(rise), np.ones(rest + hold)])
        usual = protocol.settling_friction * self.friction
        settling = settling_frictions or [usual] * len(loads)
        return [
            Schedule.between(self.idle, load, shares, (high, self.friction), rise + rest, rise)
            for load, high in zip(loads, settling, strict=True)
        ]

    def ramp(
        self, limits: Sequence[Load], shares: tuple[float, float]
    ) -> tuple[tuple[Trace, ...], Array]:
        """Raise each load between two shares of itself; return the motions and the shares (n,)."""
        rises, climb = self.ramps(limits, shares)
        return self._traces(rises), climb

    def ramps(
        self, limits: Sequence[Load], shares: tuple[float, float]
    ) -> tuple[list[Schedule], Array]:
        """Schedule a slow rise of each load from one share to another, loaded to it as in a hold.

        The forces balance the load all the way, whether the fingers can apply them or not. Gives
        also the share that is applied in each watched sample.
        """
        hold, (lower, upper) = self.setup.hold, shares
        rise, rest, count = self._counts(hold.load_s, hold.settle_s, self.setup.limit.ramp_s)
        climb = lower + (upper - lower) * np.arange(1, count + 1) / count
        applied = np.concatenate([lower * smooth(rise), np.full(rest, lower), climb])
        frictions, every = (hold.settling_friction * self.friction, self.friction), len(applied)
        return [
            Schedule.between(self.idle, limit, applied, frictions, rise + rest, every)
            for limit in limits
        ], climb

    def at_rest(self, settling_friction: float) -> "Rig":
        """Let the unloaded object settle, so that it need not before each release."""
        assert self.closed is not None  # noqa: S101 - rigid fingers have not closed
        (motion,) = self._simulated([self.settling(settling_friction)])
        return replace(self, closed=motion.after(self.closed), settled=True)

    def settling(self, friction: float) -> Schedule:
        """Schedule what comes before a release: the unloaded object settles."""
        (count,) = self._counts(self.setup.friction.settle_s)
        frictions = friction, friction
        return Schedule.between(self.idle, self.idle, np.ones(count), frictions, count, 0)

    def release(
        self, settling_friction: float, frictions: Sequence[float], threshold_m: float | None = None
    ) -> tuple[Trace, ...]:
        """Lower the friction of the unloaded object to several values, and trace its motion."""
        limits = None if threshold_m is None else Thresholds(threshold_m)
        return self._traces(self.releases(settling_friction, frictions), limits)

    def releases(self, settling_friction: float, frictions: Sequence[float]) -> list[Schedule]:
        """Schedule a release to each friction."""
        rest, hold = self._counts(self.setup.friction.settle_s, self.setup.friction.hold_s)
        rest *= not self.settled
        return [
            Schedule.between(
                self.idle, self.idle, np.ones(rest + hold), (settling_friction, friction), rest, 0
            )
            for friction in frictions
        ]

    def joints(self, trials: Sequence[Schedule]) -> Array:
        """Return joint positions in trials, from closed fingers on, (trials, n, 7 + 3k)."""
        return np.array([motion.joints for motion in self._simulated(trials)])

    def _counts(self, *durations_s: float) -> list[int]:
        return [samples(duration_s, self.bench.sample_s) for duration_s in durations_s]

    def _simulated(
        self, trials: Sequence[Schedule], ends: EarlyEnds | None = None
    ) -> tuple[Motion, ...]:
        told = [trial.told(self.bench.scene.layout) for trial in trials]
        start = self.closed and self.closed.state
        return self.bench.simulated(told, start, ends and ends.following)

    def _traces(
        self, trials: Sequence[Schedule], limits: Thresholds | None = None
    ) -> tuple[Trace, ...]:
        bench, ends, closed = self.bench, None, self.closed
        if limits is not None and not self.whole:
            at = None if closed is None or not len(closed.joints) else closed.joints[-1]
            ends = EarlyEnds(bench.scene.layout, trials, bench.sample_s, limits, at)
        return self._traced(trials, self._simulated(trials, ends))

    def _traced(self, trials: Sequence[Schedule], motions: Sequence[Motion]) -> tuple[Trace, ...]:
        closed = self.closed
        whole = motions if closed is None else [motion.after(closed) for motion in motions]
        watched = [
            trial.watched - motion.skipped for trial, motion in zip(trials, motions, strict=True)
        ]
        return traces(whole, self.bench.scene.layout, watched, closed if self.settled else None)


def pushes(planned: Array, joints: Array, layout: Layout) -> Array:
    """Compute forces of servos, (n, k, 3) [N]: the planned ones, less what their springs gave way.

    They are along the axes of the contacts, and at rest they are the contact forces.
    """
    local = np.einsum("kij,nki->nkj", layout.frames, planned)
    forces = local - layout.drive.stiffness_n_per_m * joints[:, 7:].reshape(local.shape)
    forces[..., 0] = np.clip(forces[..., 0], 0.0, layout.drive.max_normal_force_n)
    return forces


def squeezed(
    bench: Bench[Scene], setup: Setup, forces: Array, friction: float,
    settling_friction: float | None = None,
) -> Rig:  # fmt: skip
    """Close the fingers of a compiled scene on the unloaded object."""
    high = settling_friction or setup.hold.settling_friction * friction
    opened, idle = Load(np.zeros(6), np.zeros_like(forces)), Load(np.zeros(6), forces)
    shares = smooth(samples(setup.hold.squeeze_s, bench.sample_s))
    closing = Schedule.between(opened, idle, shares, (high, high), len(shares), len(shares))
    (closed,) = bench.simulated([closing.told(bench.scene.layout)])
    return Rig(bench, setup, friction, idle, closed)


def closed_on(
    scene: Scene, setup: Setup, friction: float, settling_friction: float | None = None
) -> Rig:
    """Close the fingers of a scene on the unloaded object, with the squeeze of its layout."""
    bench = Bench(scene, threads=setup.threads, timeout_s=setup.timeout_s)
    return squeezed(bench, setup, scene.layout.squeeze_forces, friction, settling_friction)


LATER = 8.0
"""Displacement at the second reading of a ramp, relative to the first; 8 = 2 cubed."""
OVERLOAD = 2.0
"""Largest share of the limit for which forces are planned; for larger loads the forces stay the
same."""
HELD, SLID, UNKNOWN = 1, 0, -1


@declared
class SimulatedLimit(Declared):
    """Two shares of a wrench's predicted limit: the object holds the first and not the second."""

    lower: float
    upper: float
    share: float
    """Best estimate of where the object lets go: a ramp's threshold, or a bisection's middle."""


def ramped_limits(rig: Rig, limits: Sequence[Load]) -> tuple[SimulatedLimit | None, ...]:
    """Find by slowly rising loads the shares of the limits at which the object lets go."""
    threshold = rig.setup.limit.ramp_threshold * rig.bench.scene.layout.grasp_size_m

    def search(chosen: Sequence[Load], span: float) -> list[SimulatedLimit | None]:
        traces, shares = rig.ramp(chosen, (1.0 - span, 1.0 + span))
        return [_onset(trace, shares, threshold) for trace in traces]

    return _in_some_span(rig, limits, search)


def _in_some_span(
    rig: Rig,
    limits: Sequence[Load],
    search: Callable[[Sequence[Load], float], Sequence[SimulatedLimit | None]],
) -> tuple[SimulatedLimit | None, ...]:
    """Search near each predicted limit first, then in wider intervals; None if nothing is found."""
    found: dict[int, SimulatedLimit] = {}
    for span in rig.setup.limit.spans:
        rest = [place for place in range(len(limits)) if place not in found]
        if not rest:
            break
        answers = search([limits[place] for place in rest], span)
        found |= {place: at for place, at in zip(rest, answers, strict=True) if at is not None}
    return tuple(found.get(place) for place in range(len(limits)))


def _onset(trace: Trace, shares: Array, threshold: float) -> SimulatedLimit | None:
    """Find where a ramp lets go; None if it does not let go, or does at its very start."""
    moved = trace.displacements_m
    passed = np.flatnonzero(moved >= threshold)
    if not passed.size or passed[0] == 0 or trace.health.fault:
        return None
    first = int(passed[0])
    before, after = shares[first - 1], shares[first]
    # Interpolate the cube root of the displacement, which is linear in time.
    roots = np.cbrt([moved[first - 1], threshold, moved[first]])
    at = before + (after - before) * (roots[1] - roots[0]) / (roots[2] - roots[0])
    later = np.flatnonzero(moved >= LATER * threshold)
    # Twice the time since the limit has passed at eight times the displacement, so the limit lies
    # as far before the first reading as the second lies after it.
    lower = 2.0 * before - shares[later[0]] if later.size else shares[0]
    return SimulatedLimit(lower=float(lower), upper=float(after), share=float(at))


def bisected_limits(rig: Rig, limits: Sequence[Load]) -> tuple[SimulatedLimit | None, ...]:
    """Find the shares of the limits at which the object lets go, by bisection."""

    def search(chosen: Sequence[Load], span: float) -> list[SimulatedLimit | None]:
        held, let_go = np.full(len(chosen), 1.0 - span), np.full(len(chosen), 1.0 + span)
        inside = (_ends(rig, chosen, held) == HELD) & (_ends(rig, chosen, let_go) == SLID)
        for _ in range(rig.setup.limit.rounds):
            open_places = np.flatnonzero(inside)
            if not open_places.size:
                break
            middle = 0.5 * (held + let_go)[open_places]
            ends = _ends(rig, [chosen[int(place)] for place in open_places], middle)
            held[open_places[ends == HELD]] = middle[ends == HELD]
            let_go[open_places[ends == SLID]] = middle[ends == SLID]
            inside[open_places[ends == UNKNOWN]] = False
        return [
            SimulatedLimit(float(low), float(high), float(0.5 * (low + high))) if found else None
            for low, high, found in zip(held, let_go, inside, strict=True)
        ]

    return _in_some_span(rig, limits, search)


def _ends(rig: Rig, limits: Sequence[Load], shares: Array) -> Indices:
    """Tell whether shares of loads hold: `HELD`, `SLID`, or `UNKNOWN` if a trial is not valid."""
    loads = [part(rig.idle, limit, share) for limit, share in zip(limits, shares, strict=True)]
    layout, protocol = rig.bench.scene.layout, rig.setup.hold
    ends = [holds(trace, layout, protocol) for trace in rig.hold(loads)]
    return np.array([UNKNOWN if end is None else int(end) for end in ends])


def part(idle: Load, limit: Load, share: float) -> Load:
    """Return a share of a wrench, with forces between those without load and those at the limit."""
    planned = min(float(share), OVERLOAD)
    wrench = idle.wrench + share * (limit.wrench - idle.wrench)
    return Load(wrench, (1.0 - planned) * idle.forces + planned * limit.forces)


ABOVE = (5e-4, 1e-3, 2e-3, 3e-3)
"""Excess of the friction that forces are planned for, relative to the critical friction. The values
are tried in turn. The simulated critical friction is too high by the same excess."""
LEAST_PUSH = 1e-3
"""Least normal force that counts as pushing, relative to the largest one. With less than half of
it, boxes were seen to turn up to 9 % above their critical friction."""
TILT = 2e-3
"""Largest displacement at which the object still counts as staying, relative to the grasp size
times the critical friction. A tilt of the object acts like that much additional friction; servos
hide a force imbalance of five times as much, in largest normal forces."""


@declared
class CriticalFriction(Declared):
    """The critical friction that the analysis predicts, and the one that simulation finds."""

    predicted: OrInfinity
    """The critical friction by analysis."""
    simulated: float | None = None
    """The middle of the bracket. It is zero if the object stays even at `least_friction`, and None
    if nothing was measured or the object does not begin to slip near the prediction."""
    bracket: tuple[float, float] | None = None
    """The object slipped at the first friction and stayed at the second."""


def released_friction(
    bench: Bench[Scene], positions: Array, normals: Array, predicted: float, setup: Setup, *,
    whole: bool = False,
) -> CriticalFriction:  # fmt: skip
    """Measure the critical friction of a grasp whose scene is compiled with any friction."""
    protocol = setup.friction
    high = protocol.settling_friction * max(predicted, protocol.least_friction)
    # The excess is relative, so a prediction of zero needs a friction to be relative to.
    least = max(predicted, 0.5 * protocol.least_friction)
    forces = forces_just_above(positions, normals, least, setup.physics)
    forces *= SQUEEZE * setup.fingers.max_normal_force_n
    rig = replace(squeezed(bench, setup, forces, predicted, high).at_rest(high), whole=whole)

    share = min(protocol.threshold, TILT * max(predicted, protocol.least_friction))

    def stays(frictions: list[float]) -> list[bool | None]:
        threshold = share * bench.scene.layout.grasp_size_m
        return [trace.stayed(threshold) for trace in rig.release(high, frictions, threshold)]

    if predicted < protocol.least_friction:
        (held,) = stays([protocol.least_friction])
        bracket = (0.0, protocol.least_friction) if held else None
        return CriticalFriction(predicted, 0.0 if held else None, bracket)
    bracket = bisected(stays, predicted, protocol)
    middle = None if bracket is None else 0.5 * (bracket[0] + bracket[1])
    return CriticalFriction(predicted, middle, bracket)


def bisected(
    stays: Callable[[list[float]], list[bool | None]], predicted: float, protocol: FrictionProtocol
) -> tuple[float, float] | None:
    """Bracket the friction at which the object begins to stay; None if not near the prediction."""
    for span in protocol.spans:
        lower, upper = (1.0 - span) * predicted, (1.0 + span) * predicted
        if stays([lower, upper]) == [False, True]:
            for _ in range(protocol.rounds):
                middle = 0.5 * (lower + upper)
                (stayed,) = stays([middle])
                if stayed is None:
                    return None
                lower, upper = (lower, middle) if stayed else (middle, upper)
            return lower, upper
    return None


def forces_just_above(
    positions: Array, normals: Array, critical: float, physics: Softness = HARD
) -> Array:
    """Find balanced forces that need almost the critical friction, (k, 3), largest push 1 N.

    Every finger pushes enough with them, or they are for the largest friction in `ABOVE`.
    """
    forces = None
    for above in ABOVE:
        try:
            forces = even_forces(
                positions, normals, (1.0 + above) * critical, torsion_m=physics.torsion_m
            )
        except (NoForcesError, SolverError):
            continue
        if np.einsum("ki,ki->k", forces, normals).min() >= LEAST_PUSH:
            break
    if forces is None:
        raise UndecidedError(
            "no balanced forces were found in which every finger pushes, at frictions just above "
            f"the critical friction {critical:.6g}"
        )
    return forces


NO_PUSH = 1e-9
"""Normal forces below this share of the largest one count as zero."""


@dataclass(frozen=True, slots=True, eq=False)
class PlannedLoad:
    """One wrench that a grasp is tested with, and what the analysis predicts about it."""

    name: str
    load: Load
    """The wrench that is applied, and the finger forces planned for it."""
    predicted_limit: float
    limit: Load
    """The wrench at its predicted limit, and the finger forces that balance it."""
    required_friction: float
    """The friction coefficient that the planned forces need, with the torques of soft contacts."""


@dataclass(frozen=True, slots=True, eq=False)
class Analysis:
    """Contacts on an object as the analysis sees them: what they resist, with which forces."""

    body: Polyhedron
    contacts: Sequence[Contact]
    friction: float
    setup: Setup
    motors: Motors | None
    """Motors that make the contact forces; None for fingertips."""

    @property
    def resisted(self) -> WrenchBody:
        """The body of wrenches that are resisted, with torques about the centre of mass."""
        positions, normals = stacked(self.contacts)
        frictions, setup = contact_frictions(self.friction, len(self.contacts)), self.setup
        return WrenchBody(
            positions - self.body.center_of_mass, normals, frictions,
            setup.fingers.max_normal_force_n, self.motors,
            torsions=contact_torsions(setup.physics.torsion_m, frictions),
        )  # fmt: skip

    def limit(self, wrench: Array) -> WrenchLimit:
        """Find the largest multiple of a wrench that is resisted."""
        return limit_of(self.resisted, wrench)

    def planned(self, idle: Load, agenda: Agenda) -> tuple[PlannedLoad, ...]:
        """Plan all wrenches to test, in order: along axes, weakest, random, the user's own."""
        share = self.setup.hold.load_share
        relative = [
            self._load(name, found, share * found.limit, idle)
            for name, found in _relative(self.resisted, self.body.radius, agenda)
        ]
        own = [(each.name, each.wrench) for each in agenda.wrenches]
        return (*relative, *self.as_they_are(idle, own))

    def as_they_are(
        self, idle: Load, wrenches: Sequence[tuple[str, Array]]
    ) -> tuple[PlannedLoad, ...]:
        """Plan finger forces for wrenches that are applied as given, not at a share of a limit."""
        resisted = self.resisted
        return tuple(
            self._load(name, limit_of(resisted, wrench), 1.0, idle) for name, wrench in wrenches
        )

    def _load(self, name: str, found: WrenchLimit, multiple: float, idle: Load) -> PlannedLoad:
        """Plan a multiple of a wrench, with forces between those at rest and those at the limit.

        The friction that they need is the largest ratio of a tangential to a normal force.
        """
        wrench = to_digits(multiple * found.wrench)
        predicted = found.limit / multiple
        limit = Load(predicted * wrench, to_digits(found.forces))
        share = 1.0 / predicted if predicted > 0.0 else 0.0
        load = Load(wrench, part(idle, limit, share).forces if share else idle.forces)
        positions, normals = stacked(self.contacts)
        along, across = normal_and_tangential(load.forces, normals)
        pushing = along > NO_PUSH * along.max()
        along, across = along[pushing], across[pushing]
        if found.torques is not None:  # the normal force counts as far as the torque leaves it
            share = min(share, 1.0)
            # the torques about the normals, of least norm, that balance the load at rest
            arms = positions - self.body.center_of_mass
            missing = idle.wrench[3:] + cross(arms, idle.forces).sum(axis=0)
            resting = np.asarray(np.linalg.lstsq(normals.T, -missing, rcond=None)[0], dtype=float)
            torques = (1.0 - share) * resting + share * found.torques
            turning = np.abs(torques[pushing]) / self.setup.physics.torsion_m
            along = np.sqrt(np.maximum(along**2 - turning**2, (NO_PUSH * along) ** 2))
        required = rounded((across / along).max())
        return PlannedLoad(name, load, predicted, limit, required)


def _relative(
    resisted: WrenchBody, torque_scale: float, agenda: Agenda
) -> list[tuple[str, WrenchLimit]]:
    """Name the wrenches that are applied at a share of their limit, and compute each limit."""
    axes = [limit_of(resisted, wrench) for wrench in axis_wrenches(torque_scale)]
    weakest = weakest_from(resisted, axes, torque_scale)
    rng = np.random.default_rng(agenda.seed)
    scale = np.array([1.0] * 3 + [torque_scale] * 3)
    drawn = rng.normal(size=(agenda.random_wrenches, 6))
    units = scale * drawn / np.linalg.norm(drawn, axis=1, keepdims=True)
    others = [(RANDOM.format(place), limit_of(resisted, unit)) for place, unit in enumerate(units)]
    return [*zip(AXIS_NAMES, axes, strict=True), (WEAKEST, weakest), *others]
