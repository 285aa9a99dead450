"""Exports the grasps of a plan as a binary glTF scene, which docs/files.md describes."""

import importlib
import math
from pathlib import Path
from typing import Any, get_args

import numpy as np

from grasp_core.allowed_values import SMALLEST, instance, number, one_of, path_of
from grasp_core.errors import InputError
from grasp_core.files.text_files import write_parts
from grasp_core.frames import poses_along
from grasp_core.planning.result import Plan
from grasp_core.values import Grasp
from scenes.drawing import sheets
from scenes.drawing.painting import approaches
from scenes.mujoco.fingertip_room import fitting_radius
from scenes.settings import EXPORT_ENDINGS, GraspFormat

ROD_LENGTH = 0.5
"""Length of the rods where no free lines were planned, in object radii."""
GRID_SPACING = 2.5
"""Distance between neighbouring grasps of a grid, in object radii and rod lengths: two of each keep
them apart, and the rest is for the fingertips."""
ROD_SIDES = 24
ROUGHNESS = 0.6


def _figures(plan: Plan, grasp: Grasp) -> dict[str, str | float]:
    lower, upper = grasp.ferrari_canny
    numbers = {
        "friction": plan.friction,
        "critical_friction": grasp.critical_friction,
        "closure_margin": grasp.closure_margin,
        "ferrari_canny_lower_n": lower,
        "ferrari_canny_upper_n": upper,
        "radius_m": grasp.radius,
    }
    # JSON has no infinity, which a critical friction is where none suffices
    finite = {name: value for name, value in numbers.items() if math.isfinite(value)}
    return {"id": grasp.id, "family": grasp.family, **finite}


def glb(plan: Plan, fingertip_radius_m: float | None) -> bytes:
    """Return the bytes of a GLB file; equal plans give equal bytes."""
    trimesh: Any = importlib.import_module("trimesh")
    body, radius, length = plan.body, fingertip_radius_m, ROD_LENGTH * plan.body.radius
    if plan.finger is not None:
        radius, length = radius or plan.finger.radius_m, plan.finger.approach_m
    columns, step = math.ceil(math.sqrt(len(plan))), GRID_SPACING * (body.radius + length)
    scene = trimesh.Scene()
    scene.geometry["object"] = _painted(trimesh, body.to_trimesh(), sheets.GLASS)
    for place, grasp in enumerate(plan.grasps):
        here, name = np.eye(4), f"grasp_{place}"
        here[:2, 3] = step * (place % columns), step * (place // columns)
        scene.graph.update(name, matrix=here, metadata=_figures(plan, grasp))
        scene.graph.update(f"{name}_object", name, matrix=np.eye(4), geometry="object")
        tip_radius = radius or fitting_radius(body, grasp.positions, grasp.normals)
        _add_fingers(trimesh, scene, name, grasp, tip_radius, length)
    return scene.export(file_type="glb")


def _add_fingers(
    trimesh: Any, scene: Any, name: str, grasp: Grasp, radius: float, length: float
) -> None:
    # the origin of a rod's frame is the centre of the tip, and the rod lies behind it
    rods = poses_along(grasp.positions - radius * grasp.normals, approaches(grasp))
    for finger, (contact, rod) in enumerate(zip(grasp.contact_frames(), rods, strict=True)):
        tip, bar = _shapes(trimesh, scene, finger, radius, length)
        named = f"{name}_finger_{finger}"
        told = {"position_m": contact[:3, 3], "normal": contact[:3, 2]}
        scene.graph.update(named, name, matrix=contact, geometry=tip, metadata=told)
        scene.graph.update(f"{named}_rod", name, matrix=rod, geometry=bar)


def _shapes(
    trimesh: Any, scene: Any, finger: int, radius: float, length: float
) -> tuple[str, str]:  # fmt: skip
    """Make the shapes of a finger, unless an earlier grasp has the same; return their names."""
    tip, bar = f"tip_{finger}_{radius!r}", f"rod_{finger}_{radius!r}_{length!r}"
    if tip not in scene.geometry:
        ball = trimesh.creation.uv_sphere(radius=radius, count=[ROD_SIDES // 2, ROD_SIDES])
        ball.apply_translation([0.0, 0.0, -radius])  # it touches the origin of the contact's frame
        scene.geometry[tip] = _painted(trimesh, ball, sheets.FINGER_COLOURS[finger])
    if bar not in scene.geometry:
        segment = [[0.0, 0.0, -length], [0.0, 0.0, 0.0]]
        made = trimesh.creation.cylinder(radius=radius, segment=segment, sections=ROD_SIDES)
        scene.geometry[bar] = _painted(trimesh, made, sheets.FINGER_COLOURS[finger])
    return tip, bar


def _painted(trimesh: Any, mesh: Any, colour: str) -> Any:
    material = trimesh.visual.material.PBRMaterial(
        name=colour,
        baseColorFactor=[*sheets.rgb(colour), 1.0],
        metallicFactor=0.0,
        roughnessFactor=ROUGHNESS,
    )
    mesh.visual = trimesh.visual.TextureVisuals(material=material)
    return mesh


def export_grasps(
    plan: Plan, path: str | Path, to: GraspFormat = "gltf", *,
    fingertip_radius_m: float | None = None,
) -> Path:  # fmt: skip
    """Write the grasps of a plan for another program, as one file; equal plans give equal bytes.

    Args:
        plan: A plan, as `gc.plan` or `gc.load_grasps` returns it; a slice or what `plan.filter`
            gives has fewer grasps.
        path: Path of the file, which ends in glb; missing folders are made.
        to: The format: `gltf`, a binary glTF scene, which docs/files.md describes.
        fingertip_radius_m: Radius of the fingertips, at most that of the object [m]; None takes
            the planned one, or a tenth of the object's radius, or less where that does not fit.

    Returns:
        The path.

    Raises:
        InputError: A value is refused, or the plan has no grasp.
        OSError: The file cannot be written.
    """
    instance(plan, Plan, "plan", "gc.plan makes plans")
    path = path_of(path, "path")
    one_of(to, get_args(GraspFormat), "to")
    if path.suffix.lower() not in EXPORT_ENDINGS[to]:
        wanted = " or ".join(EXPORT_ENDINGS[to])
        raise InputError(f"path must end in {wanted} for the format {to}, got {path.name[-40:]!r}")
    if fingertip_radius_m is not None:
        number(fingertip_radius_m, "fingertip_radius_m", ge=SMALLEST, le=plan.body.radius,
               where=", the object's radius in m")  # fmt: skip
    if not plan.grasps:
        raise InputError("plan: expected at least one grasp to export, found none")
    return write_parts(path, [glb(plan, fingertip_radius_m)])
