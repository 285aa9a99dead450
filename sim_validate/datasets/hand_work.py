"""Has the hand of a dataset look for a pose in a grasp, and do there what the settings ask."""

from grasp_core.errors import UnfaithfulError
from grasp_core.hands.hand import Hand
from grasp_core.hands.settings import ReachSettings
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Grasp
from sim_validate.datasets.config import DatasetConfig
from sim_validate.datasets.hand_columns import HandCells
from sim_validate.hands.reached_grasps import HandTask, execution_with, reached_grasp
from sim_validate.processes.own_faults import OWN_FAULTS


def hand_cells(
    hand: Hand, config: DatasetConfig, body: Polyhedron, grasp: Grasp, friction: float, *,
    simulated: bool,
) -> HandCells:  # fmt: skip
    """Return what a hand does in a grasp in force closure; in simulation if that is wanted.

    Where a simulation is refused, the pose is there all the same, with the reason as a note.
    """
    pose, note = ReachSettings(seed=config.seed), ""
    if simulated and config.hand is not None:
        try:
            execution = execution_with(config.hand, body)
            task = HandTask(pose, config.hand.simulate, execution, enough=False)
            return HandCells.of(hand, reached_grasp(hand, body, grasp, friction, task))
        except (*OWN_FAULTS, UnfaithfulError) as error:
            note = str(error)
    found = reached_grasp(hand, body, grasp, friction, HandTask(pose))
    return HandCells.of(hand, found, note)
