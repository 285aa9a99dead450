"""Reads or plans the grasps that a marked pytest test is run with."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from grasp_core.errors import InputError
from grasp_core.objects.polyhedron import Polyhedron, load_polyhedron
from grasp_core.planning.planner import plan
from grasp_core.values import Grasp
from scenes.example_objects import example_object
from sim_validate.baselines.parts.changed_part import present
from sim_validate.baselines.parts.if_changed import TABLE, if_changed
from sim_validate.baselines.parts.source_file import Source, source_of
from sim_validate.records.grasps import read_grasps

FRICTION = 0.5
"""Friction of grasps for which the test gives none."""
SETTINGS = ("object", "friction", "limit", "families", "cones", "seed", "unit", "scale")


@dataclass(frozen=True, slots=True, eq=False)
class GraspCase:
    """A grasp on its object, and the friction at which to test it."""

    body: Polyhedron
    grasp: Grasp
    friction: float
    source: Source = field(default_factory=Source)
    """The mesh file that the grasp was planned from, if it comes from a file of grasps."""
    gone: str = ""
    """Why the grasp does not exist on its changed part; empty if it does. Object and grasp are then
    those that the file holds."""


def case_of(
    given: Sequence[Any], friction: float | None, asking: str = "assert_stable"
) -> GraspCase:
    """Build a case from a test's arguments: a case, or object, grasp and perhaps friction."""
    kinds: list[type[Any]] = [type(each) for each in given]
    if kinds == [GraspCase]:
        case: GraspCase = given[0]
        return case if friction is None else replace(case, friction=_number(friction))
    if kinds[:2] == [Polyhedron, Grasp] and len(given) <= len(("object", "grasp", "friction")):
        named = [] if friction is None else [friction]
        frictions = [*given[2:], *named]
        if len(frictions) <= 1:
            return GraspCase(given[0], given[1], _number(*frictions) if frictions else FRICTION)
    got = ", ".join(kind.__name__ for kind in kinds)
    raise InputError(
        f"{asking}: expected a grasp_case, or an object, a grasp and a friction; got {got}"
    )


def grasp_cases(folder: Path, args: Sequence[Any], settings: Mapping[str, Any]) -> list[GraspCase]:
    """Read or plan the grasps that a pytest marker asks for."""
    if len(args) > 1 or not all(isinstance(each, str) for each in args):
        raise InputError(
            f"@pytest.mark.grasp takes the path of one file of grasps, got {list(args)}"
        )
    known = ("friction", TABLE) if args else SETTINGS
    for name in settings:
        if name not in known:
            beside = " beside a file of grasps" if args else ""
            raise InputError(
                f"@pytest.mark.grasp has no setting {name!r}{beside}; it takes {', '.join(known)}"
            )
    friction = _number(settings.get("friction", FRICTION))
    if args:
        return _cases_of_file(folder, folder / args[0], settings)
    wanted: dict[str, Any] = {"limit": 1, **settings, "friction": friction}
    body = _body(folder, wanted)
    grasps = _planned(body, wanted)
    _check_any(grasps, body, friction)
    return [GraspCase(body, grasp, friction) for grasp in grasps]


def _cases_of_file(folder: Path, path: Path, settings: Mapping[str, Any]) -> list[GraspCase]:
    """Read the grasps of a file, and carry them over to their part as it is now."""
    saved = read_grasps(path)
    friction = _number(settings.get("friction", saved.friction))
    _check_any(saved.grasps, saved.body, friction)
    asked = if_changed(settings.get(TABLE, {}))
    source = source_of(saved, path, [folder], scale=asked.scale)
    now = present(replace(saved, friction=friction), path, source, asked)
    tested = {grasp.id: grasp for grasp in now.saved.grasps}
    return [
        GraspCase(now.saved.body, tested[each.id], friction, now.mesh)
        if each.id in tested
        else GraspCase(saved.body, each, friction, now.mesh, f"{each.id} is gone: "
                       f"{now.gone[each.id]}; {now.change}")
        for each in saved.grasps
    ]  # fmt: skip


def _check_any(grasps: Sequence[Grasp], body: Polyhedron, friction: float) -> None:
    if not grasps:
        raise InputError(
            f"@pytest.mark.grasp: no grasp of {body.name} was found at friction {friction:g}; try "
            "a higher friction"
        )


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"friction must be a number, got {value!r}")
    return float(value)


def _planned(body: Polyhedron, wanted: Mapping[str, Any]) -> Sequence[Grasp]:
    try:
        return plan(body, **wanted).grasps
    except (TypeError, ValueError) as error:
        raise InputError(f"@pytest.mark.grasp: a setting is of the wrong kind: {error}") from error


def _body(folder: Path, wanted: dict[str, Any]) -> Polyhedron:
    """Load the object, and remove its settings from the wanted ones."""
    name = wanted.pop("object", None)
    lengths = {each: wanted.pop(each) for each in ("unit", "scale") if each in wanted}
    if not isinstance(name, str):
        raise InputError("@pytest.mark.grasp needs the path of a grasps.json, or object=...")
    if Path(name).suffix:
        return load_polyhedron(folder / name, **lengths)
    return example_object(name)
