"""Saves plans as `grasps.json` and loads them; commands read and write the same files."""

import math
from collections.abc import Iterable
from functools import partial
from pathlib import Path

from grasp_core.checked import coefficient, instance, path_of, several, shown
from grasp_core.errors import InputError
from grasp_core.files.text_files import read_text, write_text
from grasp_core.frames import kept_angle
from grasp_core.objects.on_faces import check_on_faces
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.certify import check_witness
from grasp_core.planning.result import Outcomes, Plan, PlanCounts
from grasp_core.records.grasps_json import plan_from_json, plan_to_json
from grasp_core.values import FINGERS, Grasp


def save_grasps(path: str | Path, plan: Plan) -> Path:
    """Write a plan as a `grasps.json`, which `graspproof validate` and all other commands read.

    A slice of a plan, such as `plan[:5]`, and what `plan.filter` gives can be written as well.

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
    try:
        return plan_from_json(text)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def plan_of(body: Polyhedron, grasps: Iterable[Grasp], friction: float) -> Plan:
    """Make a plan of given grasps, such as the first few of `gc.iter_grasps` or improved ones.

    Nothing is searched: face quadruples without one of the grasps count as open.

    Args:
        body: The object.
        grasps: Grasps on the faces of `body`, with different ids, the best first.
        friction: Coulomb coefficient that they were planned with.

    Raises:
        InputError: A grasp is not on the object, two have one id, or the witness of one does not
            fit this friction.
    """
    instance(body, Polyhedron, "body")
    coefficient(friction)
    listed = several(grasps, partial(instance, kind=Grasp, name="grasps"), "grasps", "grasps")
    seen = set[str]()
    for grasp in listed:
        if grasp.id in seen:
            raise InputError(f"grasps: two have the id {shown(grasp.id)}; ids must differ")
        seen.add(grasp.id)
        check_on_faces(body, grasp)
        check_witness(body, grasp, friction)
    every = math.comb(len(body.faces), FINGERS)
    held = len({frozenset(grasp.faces) for grasp in listed})
    return Plan(
        body=body,
        grasps=listed,
        friction=friction,
        theta=kept_angle(math.atan(friction)),
        seed=0,
        counts=PlanCounts(len(body.faces), every, None),
        outcomes=Outcomes(held=held, absent=0, open=max(every - held, 0)),
    )
