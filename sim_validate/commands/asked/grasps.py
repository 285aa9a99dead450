"""Reads the grasps that a command simulates; flags replace the file's friction and seed."""

from dataclasses import replace
from pathlib import Path

from grasp_core.records.grasps_json import SavedGrasps
from sim_validate.cli.console import Reporter
from sim_validate.records.grasps import read_grasps


def saved_grasps(path: Path, reporter: Reporter) -> SavedGrasps | None:
    """Read a `grasps.json`, and warn of what was changed in its mesh.

    None, with a word about it, if the file holds no grasp.
    """
    saved = read_grasps(path)
    for note in saved.body.surface.notes():
        reporter.warn(f"{saved.body.name}: {note}")
    if saved.grasps:
        return saved
    absence = f"{path} holds no grasp"
    reporter.say(absence)
    reporter.document({"absence": absence})
    return None


def chosen_grasps(
    saved: SavedGrasps, *, friction: float | None, seed: int | None, limit: int | None
) -> SavedGrasps:
    """Keep the first grasps, up to a limit, with another friction or seed where one is given."""
    return replace(
        saved,
        friction=saved.friction if friction is None else friction,
        seed=saved.seed if seed is None else seed,
        grasps=saved.grasps[:limit],
    )
