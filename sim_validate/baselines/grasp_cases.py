"""Grasps that a marked test is run with: those of a file, or planned on the spot."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from grasp_core.errors import InputError
from grasp_core.planner import plan
from grasp_core.polyhedra import load_polyhedron
from grasp_core.records import grasps_from_json
from grasp_core.values import Grasp, Polyhedron
from scenes.objects import example_names, example_object
from sim_validate.files import read_text

SETTINGS = ("object", "friction", "limit", "families", "cones", "seed", "unit")


@dataclass(frozen=True, slots=True, eq=False)
class GraspCase:
    """A grasp on its object, and the friction to try it at."""

    body: Polyhedron
    grasp: Grasp
    friction: float


def grasp_cases(folder: Path, file: str | None, settings: Mapping[str, Any]) -> list[GraspCase]:
    """The grasps of a marker.

    Args:
        folder: Paths start there.
        file: A grasps.json; grasps are planned if None.
        settings: `object` (a mesh file or a built-in object), `unit`, and what `plan` takes; with a
            file `friction` alone.

    Raises:
        InputError: A setting is unknown, missing or refused, or there is no grasp.
    """
    known = ("friction",) if file is not None else SETTINGS
    for name in settings:
        if name not in known:
            raise InputError(f"@pytest.mark.grasp takes {', '.join(known)} here; got {name!r}")
    if file is not None:
        saved = grasps_from_json(read_text(folder / file))
        body, grasps, friction = saved.body, saved.grasps, settings.get("friction", saved.friction)
    else:
        wanted: dict[str, Any] = {"friction": 0.5, "limit": 1, **settings}
        body, friction = _body(folder, wanted), wanted["friction"]
        grasps = plan(body, **wanted).grasps
    if not grasps:
        raise InputError(f"@pytest.mark.grasp: there is no grasp of {body.name}")
    return [GraspCase(body, grasp, friction) for grasp in grasps]


def _body(folder: Path, wanted: dict[str, Any]) -> Polyhedron:
    """The object, whose settings are taken out of what is wanted."""
    name, unit = wanted.pop("object", None), wanted.pop("unit", "m")
    if not isinstance(name, str):
        raise InputError("@pytest.mark.grasp needs a grasps.json, or object=...")
    if name in example_names():
        return example_object(name)
    return load_polyhedron(folder / name, unit=unit)
