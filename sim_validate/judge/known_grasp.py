"""Checks the simulator on a recorded grasp with known answers before any record is tried.

The hand with one hinge a finger, and what it resists with its cube, are those of
`sim_validate.hands.known_hand`: with the largest push p of a finger, which its motor or a setting
limits, the cube of half-width a and the friction mu

    across the plane of the contacts     4 mu p,
    about that axis                      4 mu a p,
    against one finger                   (1 + 2 mu) p.

Here the hand comes from the text of a file, closes on the cube and squeezes it, so that contacts,
levers, limits and servos of the whole way are checked.
"""

import math
from dataclasses import dataclass

import numpy as np

from grasp_core.values import FINGERS
from scenes.hand_files.model import compiled_hand
from scenes.mujoco.hand_texts import text_of_hand
from scenes.mujoco.published_tests import HandServos, TestedObject
from sim_validate.engine.known_cases import GateCheck
from sim_validate.hands.known_hand import (
    CUBE_HALF,
    KNOWN_TORQUE,
    SECOND_RATIO,
    KnownHand,
    cube,
    hinged_hand,
)
from sim_validate.judge.own_trial import GENTLE, ClosedHand, HandTrials
from sim_validate.judge.postures import Placed

OPENED_RAD = 0.06
"""Angle by which the hinges are open before the hand closes: 5 mm at the fingertips."""
PREDICTED, SIMULATED = (0.995, 1.005), (0.985, 1.015)
"""Intervals of limits by the analysis, and in simulation, over the exact ones: contacts of a hand
that has closed are some micrometres off."""
SPAN = 0.05
"""Share by which a load rises from below its limit to above it."""


@dataclass(frozen=True, slots=True)
class KnownGrasp(KnownHand):
    """The known hand as a recorded grasp: from the text of a file, closing on the cube."""

    def checks(self) -> tuple[GateCheck, ...]:
        """Measure what the hand resists, over the exact figures."""
        servos = HandServos()
        model = compiled_hand(text_of_hand(hinged_hand(coupled=self.coupled), servos))
        tested = TestedObject(cube(), self.friction, 0.0, self.setup.physics)
        trials = HandTrials(model, tested, self.setup, servos.stiffness_n_m_per_rad, 0.0)
        push = min(trials.push_n, KNOWN_TORQUE / self.lever_m)
        squeeze = GENTLE * push * self.lever_m / servos.stiffness_n_m_per_rad
        turns = np.tile([1.0, SECOND_RATIO] if self.coupled else [1.0], FINGERS)
        postures = np.outer([-OPENED_RAD, 0.0, squeeze], turns)
        at = Placed(np.tile(np.eye(4), (3, 1, 1)), postures, np.eye(3))
        held = ClosedHand(trials, at, trials.closed(at))
        exact = {
            "across the contacts": (np.eye(6)[2], 4.0 * self.friction * push),
            "about the axis across them": (np.eye(6)[5], 4.0 * self.friction * CUBE_HALF * push),
            "against one finger": (np.eye(6)[0], (1.0 + 2.0 * self.friction) * push),
        }
        wrenches = np.array([wrench for wrench, _ in exact.values()])
        limits = held.limits(wrenches) if len(held.contacts) == FINGERS else ()
        found = list[GateCheck]()
        for place, (name, (_, right)) in enumerate(exact.items()):
            predicted, at_share = math.nan, math.nan
            if limits:
                predicted = limits[place].limit / right
                at_share = predicted * held.lets_go_at(limits[place], SPAN)
            found += [
                GateCheck(f"limit of a recorded grasp {name}, over the exact one", predicted,
                          *PREDICTED),
                GateCheck(f"the same in simulation, {name}", at_share, *SIMULATED),
            ]  # fmt: skip
        return tuple(found)
