"""Grasps of a `grasps.json` as contact sets to replay: a grasp, or a control made from it."""

from dataclasses import replace
from pathlib import Path

from grasp_core.closure.contact_arrays import contacts_sha256
from grasp_core.closure.critical_friction import critical_friction
from grasp_core.errors import InputError
from grasp_core.records.grasps_json import SavedGrasps
from grasp_core.values import Grasp
from sim_validate.records.grasps import grasp_with_id, read_grasps, some
from sim_validate.replaying.recorded import Recorded, Wanted
from sim_validate.simulation.setup import Agenda, Setup
from sim_validate.validation.controls import negative_controls


def grasps_behind(path: Path, content_sha256: str, friction: float) -> SavedGrasps:
    """Read the grasps behind a file, at the friction that they were tried at.

    Raises:
        InputError: The grasps are missing, or belong to another object.
    """
    if not path.is_file():
        raise InputError(f"{path}: this file of grasps is missing; name it with --grasps")
    saved = read_grasps(path)
    if saved.body.content_sha256 != content_sha256:
        raise InputError(f"{path}: its object is not that of the file to replay")
    return SavedGrasps(saved.body, friction, saved.seed, saved.grasps, saved.finger)


def of_grasp(
    path: Path, saved: SavedGrasps, setup: Setup, agenda: Agenda, wanted: Wanted
) -> Recorded:
    """Choose a grasp of a file, or a control made from it."""
    grasp = grasp_with_id(path, saved, wanted.grasp)
    found = Recorded(
        grasp.id, saved.body, grasp.contacts, saved.friction, setup, agenda,
        grasp=grasp, trial=wanted.trial,
    )  # fmt: skip
    if wanted.trial is not None:
        return replace(found, name=f"{grasp.id} in trial {wanted.trial}")
    if wanted.control is None:
        return found
    exact = replace(grasp, critical_friction=critical_friction(grasp))
    controls = {
        each.name: each
        for each in negative_controls(saved.body, exact, saved.friction, agenda.seed)
    }
    if wanted.control not in controls:
        raise InputError(
            f"{path}: {grasp.id} has no control {wanted.control!r}; there is {some(controls)}"
        )
    control = controls[wanted.control]
    return replace(
        found,
        name=f"{grasp.id}:{control.name}",
        contacts=control.contacts,
        friction=control.friction,
        control=control.name,
        grasp=None,
    )


def require_contacts(path: Path, grasp: Grasp, known: str) -> None:
    """Refuse a grasp whose contacts are not those that a file is about.

    Raises:
        InputError: The hash of the contacts is not the file's.
    """
    if contacts_sha256(grasp.contacts) != known:
        raise InputError(f"{path}: is about other contacts of {grasp.id} than the grasps have now")


def require_repeat(path: Path, trial: int, trials: int) -> None:
    """Refuse the number of a repeat with noise that a file does not have.

    Raises:
        InputError: The file has fewer repeats.
    """
    if trial >= trials:
        said = f"they are 0 to {trials - 1}" if trials else "there were none (--trials)"
        raise InputError(f"{path}: there is no repeat {trial} with noise; {said}")
