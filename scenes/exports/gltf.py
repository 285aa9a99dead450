"""Writes grasps as a binary glTF scene, with trimesh: an object and four fingers for each grasp.

Each grasp is a node whose frame is the object's. Below it are the object and, for each finger, a
node at the contact whose z axis is the inward normal, and a rod. Matrices of nodes are text with
every digit; vertices are numbers of 32 bits. glTF says that lengths are metres and that y points
up; the object's axes are kept as they are. Figures of a grasp are in its node's `extras`.
"""

import importlib
from typing import Any

import numpy as np

from grasp_core.objects.polyhedron import Polyhedron
from scenes.drawing.colours import FINGERS, GLASS, rgb
from scenes.exports.placed_grasps import PlacedGrasp

SECTIONS = 24
"""Number of corners of the circles that replace round tips and rods."""
ROUGHNESS = 0.6


def glb(body: Polyhedron, grasps: tuple[PlacedGrasp, ...]) -> bytes:
    """Return the bytes of a GLB file; equal grasps give equal bytes."""
    trimesh: Any = importlib.import_module("trimesh")
    scene = trimesh.Scene()
    scene.geometry["object"] = _painted(trimesh, body.to_trimesh(), GLASS)
    for number, placed in enumerate(grasps):
        _add_grasp(trimesh, scene, f"grasp_{number}", placed)
    return scene.export(file_type="glb")


def _add_grasp(trimesh: Any, scene: Any, name: str, placed: PlacedGrasp) -> None:
    here = np.eye(4)
    here[:3, 3] = placed.offset
    scene.graph.update(name, matrix=here, metadata=dict(placed.figures))
    scene.graph.update(f"{name}_object", name, matrix=np.eye(4), geometry="object")
    for finger, (contact, rod) in enumerate(zip(placed.contacts, placed.rods, strict=True)):
        tip, bar = _shapes(trimesh, scene, placed, finger)
        named = f"{name}_finger_{finger}"
        told = {"position_m": contact[:3, 3], "normal": contact[:3, 2]}
        scene.graph.update(named, name, matrix=contact, geometry=tip, metadata=told)
        scene.graph.update(f"{named}_rod", name, matrix=rod, geometry=bar)


def _shapes(trimesh: Any, scene: Any, placed: PlacedGrasp, finger: int) -> tuple[str, str]:
    """Make the shapes of a finger, unless an earlier grasp has the same; return their names."""
    radius, length = placed.tip_radius, placed.rod_length
    tip, bar = f"tip_{finger}_{radius!r}", f"rod_{finger}_{radius!r}_{length!r}"
    if tip not in scene.geometry:
        ball = trimesh.creation.uv_sphere(radius=radius, count=[SECTIONS // 2, SECTIONS])
        ball.apply_translation([0.0, 0.0, -radius])  # it touches the origin of the contact's frame
        scene.geometry[tip] = _painted(trimesh, ball, FINGERS[finger])
    if bar not in scene.geometry:
        segment = [[0.0, 0.0, -length], [0.0, 0.0, 0.0]]
        made = trimesh.creation.cylinder(radius=radius, segment=segment, sections=SECTIONS)
        scene.geometry[bar] = _painted(trimesh, made, FINGERS[finger])
    return tip, bar


def _painted(trimesh: Any, mesh: Any, colour: str) -> Any:
    material = trimesh.visual.material.PBRMaterial(
        name=colour,
        baseColorFactor=[*rgb(colour), 1.0],
        metallicFactor=0.0,
        roughnessFactor=ROUGHNESS,
    )
    mesh.visual = trimesh.visual.TextureVisuals(material=material)
    return mesh
