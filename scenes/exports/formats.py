"""Exports the grasps of a plan as one file in the format of another program."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Literal, TypeAlias, get_args

from grasp_core.checked import SMALLEST, instance, number, one_of, path_of
from grasp_core.errors import InputError
from grasp_core.files.text_files import write_parts, write_text
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.result import Plan
from scenes.exports.gltf import glb
from scenes.exports.moveit import yaml_text
from scenes.exports.placed_grasps import PlacedGrasp, placed_grasps
from scenes.exports.usd import write_usd

GraspFormat: TypeAlias = Literal["moveit", "gltf", "usd"]
Writer: TypeAlias = Callable[[Path, Polyhedron, tuple[PlacedGrasp, ...]], object]
ENDINGS: Mapping[GraspFormat, tuple[str, ...]] = {
    "moveit": (".yaml", ".yml"),
    "gltf": (".glb",),
    "usd": (".usda", ".usdc", ".usd"),
}
"""Endings of the files that each format is written to."""
WRITERS: Mapping[GraspFormat, Writer] = {
    "moveit": lambda path, body, grasps: write_text(path, yaml_text(body, grasps)),
    "gltf": lambda path, body, grasps: write_parts(path, [glb(body, grasps)]),
    "usd": write_usd,
}


def export_grasps(
    plan: Plan,
    path: str | Path,
    to: GraspFormat,
    *,
    fingertip_radius_m: float | None = None,
) -> Path:
    """Write the grasps of a plan for another program, as one file; equal plans give equal bytes.

    `moveit` is YAML with the fields of ROS messages, `gltf` a binary glTF scene and `usd` a USD
    stage; docs/exports.md describes them. `moveit` and `usd` need the extras of the same names.

    Args:
        plan: A plan, as `gc.plan` or `gc.load_grasps` returns it; a slice or what `plan.filter`
            gives has fewer grasps.
        path: Path of the file; missing folders are made. It ends in yaml or yml, in glb, or in
            usda, usdc or usd.
        to: The format.
        fingertip_radius_m: Radius of the fingertips, at most that of the object [m]; None takes
            the planned one, or a tenth of the object's radius, or less where that does not fit.

    Returns:
        The path.

    Raises:
        InputError: A value is refused, the plan has no grasp, or the package that the format needs
            is not installed.
        OSError: The file cannot be written.
    """
    instance(plan, Plan, "plan", "gc.plan makes plans")
    path = path_of(path, "path")
    one_of(to, get_args(GraspFormat), "to")
    if path.suffix.lower() not in ENDINGS[to]:
        wanted = " or ".join(ENDINGS[to])
        raise InputError(f"path must end in {wanted} for the format {to}, got {path.name[-40:]!r}")
    if fingertip_radius_m is not None:
        number(fingertip_radius_m, "fingertip_radius_m", least=SMALLEST, most=plan.body.radius,
               where=", the object's radius in m")  # fmt: skip
    if not plan.grasps:
        raise InputError("plan: expected at least one grasp to export, found none")
    WRITERS[to](path, plan.body, placed_grasps(plan, fingertip_radius_m))
    return path
