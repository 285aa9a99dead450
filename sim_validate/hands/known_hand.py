"""Checks the simulator on a hand with known answers before any hand is simulated.

Four fingers with one hinge each hold a cube. Each hinge stands straight above its contact, at the
height l, so that a torque tau presses with tau / l along the inward normal, and no force across it
loads the hinge. With torque limits c, the cube of half-width a, and the friction mu, the hand
resists

    across the plane of the contacts     4 mu c / l,
    about that axis                      4 mu a c / l,
    against one finger                   (1 + 2 mu) c / l:                              (1)

the finger in front presses with all it has, and two of the others rub. On slippery contacts only
the two fingers along a load oppose it, by their servos of stiffness k:

    displacement = F / (2 k / l^2).                                                     (2)

Before a hand is simulated whose joints follow others, each finger has a second hinge at the height
l_2 over its contact, which follows the first, at l_1, with the ratio r. A turn of the motor moves
the fingertip by the lever l = l_1 + r l_2, and the torque of the second hinge counts at the first
with r, so that (1) and (2) hold with this l.
"""

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from grasp_core.closure.force_closure import force_closure
from grasp_core.hands.hand import Coupling, Fingertip, Hand, HandFinger, Joint, Link
from grasp_core.hands.reach import HandReach
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.quality.wrench_limits import limit_of
from scenes.example_objects import example_object
from scenes.mujoco.hand_scenes import HandScene, build_hand_scene
from sim_validate.engine.known_cases import GateCheck, two_digits
from sim_validate.engine.planned_loads import LoadPlanner
from sim_validate.engine.rig import closed_on, squeezed
from sim_validate.engine.schedules import TrialLoad
from sim_validate.engine.setup import Setup
from sim_validate.engine.simulated_limits import ramped_limits
from sim_validate.engine.stepping import Bench

CUBE_HALF, HINGE_HEIGHT, KNOWN_TIP, KNOWN_TORQUE = 0.03, 0.08, 0.01, 0.35
"""Half-width of the cube, height of the hinges over the contacts, radius of the fingertips [m], and
torque limit [N m]: those of a hand that people use."""
SECOND_HEIGHT, SECOND_RATIO = 0.03, 0.5
"""Height of the hinges that follow [m], and by how much they do."""
KNOWN_LIMIT = (0.996, 1.006)
"""Interval of simulated over exact limits."""
KNOWN_GIVE = (0.99, 1.01)
"""Interval of simulated over exact displacements."""
SLIPPERY = 1e-4
SLIPPERY_SETTLE_S = 0.5
"""Time in which the slippery cube comes to rest: five times what others are given [s]."""
GENTLE = 0.1
"""Load of the slippery cube, over what one finger presses with."""
CONTACT_WAYS = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, -0.0, -0.0], [-0.0, -1.0, -0.0]])
"""Outward normals at the contacts, (4, 3)."""


@dataclass(frozen=True, slots=True)
class KnownHand:
    """The settings and the friction with which the simulator is checked on the known hand."""

    setup: Setup
    friction: float
    coupled: bool = False
    """Whether each finger has a hinge that follows."""

    @classmethod
    def of(cls, setup: Setup, friction: float, *, coupled: bool = False) -> Self:
        """Return the case for trials with some settings."""
        return cls(replace(setup, threads=1, timeout_s=math.inf), two_digits(friction), coupled)

    @property
    def lever_m(self) -> float:
        """Lever l of a fingertip about its motor [m]."""
        return HINGE_HEIGHT + (SECOND_RATIO * SECOND_HEIGHT if self.coupled else 0.0)

    def checks(self) -> tuple[GateCheck, ...]:
        """Measure what it resists, and how far it gives way, over the exact figures."""
        body, setup, hand = cube(), self.setup, hinged_hand(coupled=self.coupled)
        reach = stance(self.friction, len(hand.joints))
        scene = build_hand_scene(hand, body, reach, self.friction, physics=setup.physics)
        limits = _limits(scene, body, reach, setup, self.lever_m)
        return (*limits, _displaced(scene, setup, self.lever_m))


def cube() -> Polyhedron:
    """Return the cube that the known hand holds."""
    box = example_object("box")
    vertices = box.vertices - box.center_of_mass
    return Polyhedron.from_mesh(
        CUBE_HALF * vertices / np.abs(vertices).max(axis=0), box.triangles, name="cube"
    )


def hinged_hand(*, coupled: bool = False) -> Hand:
    """Return the hand with one hinge a finger, or with a second one that follows the first."""
    fingers, couplings, up = list[HandFinger](), list[Coupling](), np.eye(3)[2]
    for number, out in enumerate(CONTACT_WAYS):
        axis, place = np.cross(up, out), CUBE_HALF * out + HINGE_HEIGHT * up
        hinge = Joint(f"hinge{number}", place, np.eye(3), axis, -1.0, 1.0, KNOWN_TORQUE)
        links, height = [Link(f"link{number}", hinge, (), None, None)], HINGE_HEIGHT
        if coupled:
            second, height = f"second{number}", SECOND_HEIGHT
            lower = Joint(second, (SECOND_HEIGHT - HINGE_HEIGHT) * up, np.eye(3), axis, -1.0, 1.0)
            links.append(Link(f"lower{number}", lower, (), None, None))
            couplings.append(Coupling(second, hinge.name, SECOND_RATIO))
        tip = Fingertip(KNOWN_TIP * out - height * up, KNOWN_TIP)
        fingers.append(HandFinger(f"finger{number}", tuple(links), tip))
    return Hand("known hand", (), tuple(fingers), couplings=tuple(couplings))


def stance(friction: float, joints: int = 4) -> HandReach:
    """Return the pose in which it holds the cube, with its proof at a friction."""
    proof = force_closure(CUBE_HALF * CONTACT_WAYS, -CONTACT_WAYS, friction)
    return HandReach(
        "known hand", "cube", "", "", 1, 0.0, np.arange(4), np.zeros(joints), np.eye(4), proof
    )


def _limits(
    scene: HandScene, body: Polyhedron, reach: HandReach, setup: Setup, lever_m: float
) -> tuple[GateCheck, ...]:
    friction, press = scene.layout.friction, KNOWN_TORQUE / lever_m
    exact = {
        "across the contacts": (np.eye(6)[2], 4.0 * friction * press),
        "about the axis across them": (np.eye(6)[5], 4.0 * friction * CUBE_HALF * press),
        "against one finger": (np.eye(6)[0], (1.0 + 2.0 * friction) * press),
    }
    rig = closed_on(scene, setup, friction)
    resisted = LoadPlanner(body, reach.contacts or (), friction, setup, scene.hand.motors).resisted
    loads = [
        TrialLoad(size * wrench, limit_of(resisted, wrench).forces)
        for wrench, size in exact.values()
    ]
    found = ramped_limits(rig, loads)
    return tuple(
        GateCheck(
            f"limit of motors {name}, over the exact one", math.nan if at is None else at.share,
            *KNOWN_LIMIT,
        )
        for name, at in zip(exact, found, strict=True)
    )  # fmt: skip


def _displaced(scene: HandScene, setup: Setup, lever_m: float) -> GateCheck:
    smooth = scene.limited(scene.hand.motors.limits, SLIPPERY)
    layout = smooth.layout
    # without the grasp's own friction forces, which slippery contacts do not carry
    forces = np.einsum("kij,kj->ki", layout.frames * np.array([1.0, 0.0, 0.0]), layout.squeeze)
    patient = replace(setup, hold=replace(setup.hold, settle_s=SLIPPERY_SETTLE_S))
    rig = squeezed(Bench(smooth), patient, forces, SLIPPERY)
    size = GENTLE * KNOWN_TORQUE / lever_m
    (poses,) = rig.joints(rig.holds([TrialLoad(size * np.eye(6)[0], forces)]))
    exact = size * lever_m**2 / (2.0 * smooth.hand.servo_n_m_per_rad)
    return GateCheck(
        "displacement by the servos, over the exact one", float(poses[-1, 0]) / exact, *KNOWN_GIVE
    )
