"""Says of a hand that stands in a grasp that its motors are too weak: strong ones would do."""

from contextlib import suppress
from functools import partial

from grasp_core.errors import InputError, NoForcesError, SolverError
from grasp_core.hands.hand import Hand
from grasp_core.hands.hand_motors import hand_payload
from grasp_core.hands.reach import HandReach
from grasp_core.objects.polyhedron import Polyhedron
from sim_validate.execution.verdict import ExecutedGrasp
from sim_validate.hands.execute import HandHolder
from sim_validate.hands.validate import MOST_PUSH_N
from sim_validate.settings import ExecutionSettings

STRONG_N_M = 1e3  # torque limit of motors that carry any links and any object of a hand [N m]


def too_weak(
    hand: Hand, body: Polyhedron, reach: HandReach, friction: float,
    executed: ExecutedGrasp | None, execution: ExecutionSettings | None,
) -> str:  # fmt: skip
    """Say why motors carry neither the links nor the object; empty if they do, or are unknown."""
    if any(joint.torque_limit_n_m is None for joint in hand.free_joints):
        return ""
    strong = hand.with_torque_limits(STRONG_N_M, "strong motors")
    allowed = InputError, SolverError
    if executed is not None and execution is not None and executed.reason is not None:
        with suppress(*allowed, NoForcesError):
            HandHolder(body, strong, reach, friction).squeeze(execution.for_body(body))
            return executed.reason
    payload = partial(
        hand_payload, body=body, reach=reach, friction=friction, max_push_n=MOST_PUSH_N
    )
    try:
        payload(hand)
    except allowed as error:
        with suppress(*allowed):  # links without masses are no fault of the motors
            payload(strong)
            return str(error)
    return ""
