"""Reads a grasp of a `grasps.json`, or makes a negative control from it, to simulate again."""

from dataclasses import replace
from pathlib import Path

from grasp_core.closure.contacts import contacts_sha256
from grasp_core.closure.critical_friction import critical_friction
from grasp_core.errors import InputError
from grasp_core.records.grasps_json import SavedGrasps
from grasp_core.values import Grasp
from sim_validate.records.grasps import grasp_with_id, read_grasps, some
from sim_validate.replaying.recorded import Recorded, Wanted
from sim_validate.simulation.setup import Agenda, Setup
from sim_validate.validation.controls import negative_controls


def grasps_behind(path: Path, content_sha256: str, friction: float) -> SavedGrasps:
    """Read the grasps that recorded results are about, at the friction that they were tested at."""
    if not path.is_file():
        raise InputError(
            f"{path}: this file of grasps is missing; say with --grasps where the file is"
        )
    saved = read_grasps(path)
    if saved.body.content_sha256 != content_sha256:
        raise InputError(
            f"{path}: these grasps are on another object than the results to replay; give the "
            "right --grasps"
        )
    return SavedGrasps(saved.body, friction, saved.seed, saved.grasps, saved.finger)


def of_grasp(
    path: Path, saved: SavedGrasps, setup: Setup, agenda: Agenda, wanted: Wanted
) -> Recorded:
    """Choose a grasp of a file, or a negative control made from it."""
    grasp = grasp_with_id(path, saved, wanted.grasp)
    found = Recorded(
        grasp.id, saved.body, grasp.contacts, saved.friction, setup, agenda,
        grasp=grasp, trial=wanted.trial,
    )  # fmt: skip
    if wanted.trial is not None:
        return replace(found, name=f"{grasp.id} in trial {wanted.trial}")
    if wanted.control is None:
        return found
    exact = replace(grasp, critical_friction=critical_friction(grasp, torsion_m=setup.torsion_m))
    controls = {
        each.name: each
        for each in negative_controls(
            saved.body, exact, saved.friction, agenda.seed, setup.torsion_m
        )
    }
    if wanted.control not in controls:
        raise InputError(
            f"{path}: grasp {grasp.id} has no negative control {wanted.control!r}; choose from "
            f"{some(controls)}"
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
    """Refuse a grasp whose contacts differ from those that recorded results are about."""
    if contacts_sha256(grasp.contacts) != known:
        raise InputError(
            f"{path}: the contacts of {grasp.id} have changed since these results were recorded; "
            "record them again"
        )


def require_repeat(path: Path, trial: int, trials: int) -> None:
    """Refuse the number of a repeat with noise that a file does not hold."""
    if trial >= trials:
        said = f"choose from 0 to {trials - 1}" if trials else "it was recorded without --trials"
        raise InputError(f"{path}: the file has no repeat with noise numbered {trial}; {said}")
