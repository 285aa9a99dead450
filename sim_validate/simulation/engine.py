"""Starts MuJoCo, compiles scenes and steps them: the only module that steps the simulator.

Scenes reach the simulator as text, so that the text is the whole experiment. All trials of a scene
run together on MuJoCo's own threads; each is bit for bit what a plain loop over `mj_step` gives,
whatever the number of threads.
"""

# pyright: basic, reportAttributeAccessIssue=false
# MuJoCo ships no types for its core.

from collections.abc import Sequence

import numpy as np

from grasp_core.arrays import Array, Indices
from grasp_core.errors import InputError
from scenes.silent_mujoco import batch, mujoco, unlogged

STATE = ("time", "qpos", "qvel", "ctrl", "xfrc_applied")
"""Parts of a state, which lie in the order of their bits."""


def compiled(xml: str) -> mujoco.MjModel:
    """Compile the text of a scene."""
    try:
        with unlogged():
            return mujoco.MjModel.from_xml_string(xml)
    except ValueError as error:
        raise InputError(f"MuJoCo cannot compile the scene: {error}") from error


def state_parts(model: mujoco.MjModel) -> dict[str, slice]:
    """Find where the parts of a state lie that a trial sets or reads, by their names in MuJoCo.

    A batch finds them too, but needs a whole `MjData` for it, which takes longer than most trials.
    """
    ends = {}
    for name in STATE:
        upto = 2 * int(getattr(mujoco.mjtState, f"mjSTATE_{name.upper()}")) - 1
        upto &= int(mujoco.mjtState.mjSTATE_INTEGRATION)
        ends[name] = mujoco.mj_stateSize(model, upto)
    sizes = {
        name: mujoco.mj_stateSize(model, int(getattr(mujoco.mjtState, f"mjSTATE_{name.upper()}")))
        for name in STATE
    }
    return {name: slice(end - sizes[name], end) for name, end in ends.items()}


def step(
    trials: batch.Batch, errors: dict[int, str], steps: int, going: Indices | None = None
) -> None:
    """Step trials (all, or those given by index), except those that an error ended."""
    running = going
    if errors:
        running = np.setdiff1d(np.arange(trials.nsim) if going is None else going, list(errors))
    try:
        trials.step(running, nstep=steps)
    except batch.SimulationError as failure:
        errors.update({int(trial): trials.error(int(trial)) for trial in failure.ids})


def touched(model: mujoco.MjModel, data: mujoco.MjData, tips: Sequence[int]) -> tuple[Array, Array]:
    """Find what each fingertip touches in a state of a scene.

    Gives normals out of the fingertips, (k, 3), world axes, and depths, (k,) [m]; NaN for a
    fingertip that has not exactly one contact.
    """
    with unlogged():
        mujoco.mj_forward(model, data)
    normals, depths = np.full((len(tips), 3), np.nan), np.full(len(tips), np.nan)
    for finger, tip in enumerate(tips):
        own = [contact for contact in data.contact if tip in contact.geom]
        if len(own) == 1:
            (contact,) = own
            normals[finger] = contact.frame[:3] * (1.0 if contact.geom[0] == tip else -1.0)
            depths[finger] = -contact.dist
    return normals, depths
