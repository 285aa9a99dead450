"""Saves plans as `grasps.json` and loads them; commands read and write the same files."""

from pathlib import Path

from grasp_core.checked import instance, path_of
from grasp_core.errors import about
from grasp_core.files.text_files import read_text, write_text
from grasp_core.planning.result import Plan
from grasp_core.records.grasps_json import grasps_from_json, plan_to_json


def save_grasps(path: str | Path, plan: Plan) -> Path:
    """Write a plan as a `grasps.json`, which `graspproof validate` and all other commands read.

    A slice of a plan, such as `plan[:5]`, what `plan.filter` gives, and grasps of one's own choice,
    `dataclasses.replace(plan, grasps=...)`, can be written as well.

    Args:
        path: Path of the file; missing folders are made.
        plan: A plan, as `gc.plan` or `gc.load_grasps` returns it.

    Returns:
        The path.

    Raises:
        InputError: The value is not a plan.
        OSError: The file cannot be written.
    """
    path = path_of(path, "path")
    instance(plan, Plan, "plan", "gc.plan makes plans")
    return write_text(path, plan_to_json(plan.body, plan))


def load_grasps(path: str | Path) -> Plan:
    """Read a `grasps.json` as a plan, with every grasp checked against the object in the file.

    Each grasp equals the one that was saved. A file keeps neither times nor what is known of face
    quadruples without grasps: `absences`, `undecided` and `unreached` are empty. A plan that is
    loaded and saved again gives the same bytes.

    Args:
        path: A `grasps.json`, as `save_grasps` and `graspproof plan` write it.

    Raises:
        InputError: The file is missing or invalid; the message names the file and the field.
    """
    path = path_of(path, "path")
    text = read_text(path)
    with about(path):
        return grasps_from_json(text)
