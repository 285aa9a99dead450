"""A grasp and its negative controls, from analysis through simulation to a verdict.

For each test wrench the analysis predicts the largest multiple that is resisted; a share of
it is applied in simulation, with forces planned to need the least friction. The grasp is
confirmed when all wrenches hold, and the run can be trusted when no control does.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from grasp_core.arrays import Array, to_digits
from grasp_core.closure import force_closure
from grasp_core.critical import critical_friction
from grasp_core.errors import InputError
from grasp_core.forces import closest_forces, least_friction_forces
from grasp_core.on_faces import check_on_faces
from grasp_core.resisted_wrenches import WrenchBody, axis_wrenches
from grasp_core.values import Contact, Grasp, Polyhedron, contact_frictions
from scenes.mjcf import Scene, build_scene
from scenes.physics import PhysicsSettings
from sim_validate.controls import Control, negative_controls
from sim_validate.protocol import HoldProtocol
from sim_validate.simulate import Bench, Load
from sim_validate.verdict import HoldVerdict, Outcome, judge

AXIS_NAMES = tuple(
    f"{sign}{kind}_{axis}" for sign in "+-" for kind in ("force", "torque") for axis in "xyz"
)
WEAKEST = "weakest"
SEPARATING = "separating"
"""The wrench that a control's certificate says is not resisted."""
UNLOADED = "unloaded"


@dataclass(frozen=True, slots=True, eq=False)
class WrenchVerdict:
    """One wrench hold, predicted and simulated."""

    name: str
    wrench: Array
    """Applied external wrench, (6,) [N, N m], torque about the centre of mass."""
    predicted_limit: float
    """Largest multiple of the applied wrench that the analysis says is resisted."""
    required_friction: float | None
    """What the planned forces need; None where no forces balance the wrench."""
    hold: HoldVerdict


@dataclass(frozen=True, slots=True, eq=False)
class ControlVerdict:
    """A contact set proved not to be force-closed, and what the simulator made of it."""

    control: Control
    tried: tuple[WrenchVerdict, ...]
    """Loads that no contact forces can balance."""

    @property
    def held(self) -> bool:
        """Whether any of them held: none must."""
        return any(trial.hold.outcome is Outcome.HELD for trial in self.tried)

    @property
    def failed(self) -> bool:
        """Whether all of them ended as they must, by the object moving."""
        moved = (Outcome.SLIPPED, Outcome.LOST_CONTACT, Outcome.INVALID_START)
        return all(trial.hold.outcome in moved for trial in self.tried)


@dataclass(frozen=True, slots=True)
class CriticalFriction:
    """Where the analysis puts the least friction, and where simulation finds it."""

    predicted: float
    simulated: float | None = None
    """None where it was not measured."""


@dataclass(frozen=True, slots=True, eq=False)
class Verdict:
    """What simulation says about a grasp."""

    id: str
    critical_friction: CriticalFriction
    wrenches: tuple[WrenchVerdict, ...]
    controls: tuple[ControlVerdict, ...]
    scene: Scene
    protocol: HoldProtocol

    @property
    def outcome(self) -> Outcome:
        """`held`, or how the first wrench that did not hold ended."""
        ends = (trial.hold.outcome for trial in self.wrenches)
        return next((end for end in ends if end is not Outcome.HELD), Outcome.HELD)

    @property
    def held(self) -> bool:
        """Whether every wrench held."""
        return self.outcome is Outcome.HELD

    @property
    def controls_failed(self) -> bool:
        """Whether the simulator let go of every control."""
        return all(control.failed for control in self.controls)


def validate(  # noqa: PLR0913 - the circumstances of a trial
    body: Polyhedron,
    grasp: Grasp,
    friction: float = 0.5,
    *,
    max_normal_force: float = 10.0,
    protocol: HoldProtocol | None = None,
    physics: PhysicsSettings | None = None,
    seed: int = 0,
) -> Verdict:
    """Test a grasp and its negative controls in simulation.

    Args:
        body: The object.
        grasp: A grasp in force closure at this friction.
        friction: Coulomb coefficient at every contact.
        max_normal_force: Limit of each finger's push [N].
        protocol: Durations, loads and thresholds.
        physics: Simulation settings.
        seed: Chooses how contacts are moved for a negative control.

    Raises:
        InputError: The contacts are not on the body's faces, or not closed at this friction.
    """
    check_on_faces(body, grasp)
    critical = critical_friction(grasp)
    if not (friction > critical and force_closure(grasp, friction=friction).closed):
        raise InputError(
            f"grasp {grasp.id}: force closure needs friction above {critical:.6g}, got {friction}"
        )
    protocol = protocol or HoldProtocol()
    physics = physics or PhysicsSettings()
    rig = _Rig(body, grasp.contacts, friction, max_normal_force, protocol, physics)
    wrenches = tuple(rig.hold(*test) for test in rig.loads())
    controls = tuple(
        _control(body, control, max_normal_force, protocol, physics)
        for control in negative_controls(
            body, replace(grasp, critical_friction=critical), friction, seed
        )
    )
    limits = CriticalFriction(predicted=critical)
    return Verdict(grasp.id, limits, wrenches, controls, rig.scene, protocol)


def _control(
    body: Polyhedron, control: Control, max_normal_force: float, protocol: HoldProtocol,
    physics: PhysicsSettings,
) -> ControlVerdict:  # fmt: skip
    rig = _Rig(body, control.contacts, control.friction, max_normal_force, protocol, physics)
    return ControlVerdict(control, tuple(rig.hold(*load) for load in rig.hopeless_loads(control)))


class _Rig:
    """Contacts on an object, in analysis and on the simulated bench."""

    def __init__(
        self, body: Polyhedron, contacts: tuple[Contact, ...], friction: float,
        max_normal_force: float, protocol: HoldProtocol, physics: PhysicsSettings,
    ) -> None:  # fmt: skip
        self.body, self.friction, self.protocol = body, friction, protocol
        self.positions = np.array([contact.position for contact in contacts])
        self.normals = np.array([contact.normal for contact in contacts])
        self.max_normal_force = max_normal_force
        self.resisted = WrenchBody(
            self.positions - body.center_of_mass,
            self.normals,
            contact_frictions(friction, len(contacts)),
            max_normal_force,
        )
        self.scene = build_scene(
            body, contacts, friction, max_normal_force=max_normal_force, physics=physics
        )
        self.bench = Bench(self.scene, protocol)
        forces, needed = self._planned(np.zeros(6))
        self.bench.squeeze(forces, self._settling(needed))

    def loads(self) -> Iterator[tuple[str, Array, float]]:
        """The twelve axis wrenches and the weakest one, at their share of the limit."""
        axes = axis_wrenches(self.body.radius)
        weakest = self.resisted.weakest(axes, self.body.radius).wrench
        for name, wrench in zip((*AXIS_NAMES, WEAKEST), (*axes, weakest), strict=True):
            limit = self.resisted.limit(wrench).limit
            share = self.protocol.load_share
            yield name, to_digits(share * limit * wrench), 1.0 / share

    def hopeless_loads(self, control: Control) -> Iterator[tuple[str, Array, float]]:
        """The separating wrench, and no wrench at all where not even that can be balanced."""
        scale = np.array([1.0] * 3 + [self.body.radius] * 3)
        facing = -control.separating_wrench(self.body.center_of_mass) * scale**2
        size = self.protocol.control_load * self.max_normal_force
        yield SEPARATING, to_digits(size * facing / float(np.linalg.norm(facing / scale))), 0.0
        if control.certificate.margin < -self.protocol.least_excess:
            yield UNLOADED, np.zeros(6), 0.0

    def hold(self, name: str, wrench: Array, predicted_limit: float) -> WrenchVerdict:
        """Apply one wrench in simulation and judge what happens."""
        forces, needed = self._planned(wrench)
        trace = self.bench.hold(Load(wrench, forces), self._settling(needed), self.friction)
        verdict = judge(trace, self.scene.layout.grasp_size_m, self.protocol)
        return WrenchVerdict(name, wrench, predicted_limit, needed, verdict)

    def _planned(self, wrench: Array) -> tuple[Array, float | None]:
        """Forces of least friction that balance a wrench, or the closest ones."""
        least = self.protocol.least_normal_share * self.max_normal_force
        contacts = self.positions, self.normals, self.friction
        limits, center = (least, self.max_normal_force), self.body.center_of_mass
        balanced = least_friction_forces(*contacts, wrench, normal_force=limits, center=center)
        if balanced is not None:
            return to_digits(balanced[0]), float(to_digits(np.array(balanced[1])))
        forces = closest_forces(*contacts, wrench, normal_force=limits, center=center)
        return to_digits(forces), None

    def _settling(self, needed: float | None) -> float:
        return self.protocol.settling_friction * max(self.friction, needed or 0.0)
