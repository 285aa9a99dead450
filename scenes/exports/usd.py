"""Writes grasps as a USD stage, with usd-core: an object and four fingers for each grasp.

Each grasp is an Xform whose frame is the object's. Below it are the object, an instance of one
mesh, and for each finger an Xform at the contact whose z axis is the inward normal, with a sphere,
and a cylinder. Transforms are numbers of 64 bits, vertices of 32 bits. The stage says that lengths
are metres and that z points up; the object's axes are kept as they are. Figures of a grasp are
attributes `graspproof:NAME` of its prim.
"""

import importlib
from pathlib import Path
from typing import Any

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import InputError
from grasp_core.files.text_files import replacing
from grasp_core.objects.polyhedron import Polyhedron
from scenes.drawing.flat.colours import FINGERS, GLASS, rgb
from scenes.exports.placed_grasps import PlacedGrasp

ROOT, MESH = "/grasps", "/object"


def write_usd(path: Path, body: Polyhedron, grasps: tuple[PlacedGrasp, ...]) -> None:
    """Write a USD file, as text (usda) or binary (usdc, usd) by the ending of its path."""
    try:
        names = ("Usd", "UsdGeom", "Gf", "Sdf")
        Usd, Geom, Gf, Sdf = (importlib.import_module(f"pxr.{name}") for name in names)
    except ImportError as error:
        raise InputError(
            "writing USD needs usd-core: run pip install 'graspproof[usd]' ('.[usd]' in a "
            "checkout), or take another format"
        ) from error
    stage = Usd.Stage.CreateInMemory()
    Geom.SetStageMetersPerUnit(stage, 1.0)
    Geom.SetStageUpAxis(stage, Geom.Tokens.z)
    stage.SetDefaultPrim(Geom.Xform.Define(stage, ROOT).GetPrim())
    stage.CreateClassPrim(MESH)  # a class is not drawn itself
    _mesh(Geom.Mesh.Define(stage, f"{MESH}/mesh"), body, Geom, Gf)
    pen = _Pen(stage, Geom, Gf, Sdf)
    for number, placed in enumerate(grasps):
        pen.add(f"{ROOT}/grasp_{number}", placed)
    with replacing(path) as temporary:
        stage.GetRootLayer().Export(str(temporary))


def _mesh(mesh: Any, body: Polyhedron, Geom: Any, Gf: Any) -> None:
    mesh.CreatePointsAttr(body.vertices.astype(np.float32))
    mesh.CreateFaceVertexCountsAttr(np.full(len(body.triangles), 3, dtype=np.int32))
    mesh.CreateFaceVertexIndicesAttr(body.triangles.astype(np.int32).ravel())
    mesh.CreateSubdivisionSchemeAttr(Geom.Tokens.none)
    mesh.CreateExtentAttr(Geom.PointBased.ComputeExtent(mesh.GetPointsAttr().Get()))
    mesh.CreateDisplayColorAttr([Gf.Vec3f(*rgb(GLASS))])


class _Pen:
    """Adds grasps to a stage."""

    def __init__(self, stage: Any, Geom: Any, Gf: Any, Sdf: Any) -> None:
        self.stage, self.Geom, self.Gf, self.types = stage, Geom, Gf, Sdf.ValueTypeNames

    def add(self, name: str, placed: PlacedGrasp) -> None:
        """Add a grasp with its object, its fingers and its figures."""
        here = np.eye(4)
        here[:3, 3] = placed.offset
        prim = self._xform(name, here)
        prim.SetDisplayName(placed.grasp.id)
        for figure, value in placed.figures.items():
            kind = self.types.String if isinstance(value, str) else self.types.Double
            prim.CreateAttribute(f"graspproof:{figure}", kind, custom=True).Set(value)
        shown = self._xform(f"{name}/object", np.eye(4))
        shown.GetReferences().AddInternalReference(MESH)
        shown.SetInstanceable(True)
        for finger, (contact, rod) in enumerate(zip(placed.contacts, placed.rods, strict=True)):
            self._finger(f"{name}/finger_{finger}", contact, rod, placed, rgb(FINGERS[finger]))

    def _finger(
        self, name: str, contact: Array, rod: Array, placed: PlacedGrasp,
        colour: tuple[float, float, float],
    ) -> None:  # fmt: skip
        radius, length = placed.tip_radius, placed.rod_length
        self._xform(name, contact)
        tip = self.Geom.Sphere.Define(self.stage, f"{name}/tip")
        tip.CreateRadiusAttr(radius)
        tip.AddTranslateOp().Set(self.Gf.Vec3d(0.0, 0.0, -radius))
        self._xform(f"{name}_rod", rod)
        bar = self.Geom.Cylinder.Define(self.stage, f"{name}_rod/bar")
        bar.CreateAxisAttr(self.Geom.Tokens.z)
        bar.CreateRadiusAttr(radius)
        bar.CreateHeightAttr(length)
        bar.AddTranslateOp().Set(self.Gf.Vec3d(0.0, 0.0, -0.5 * length))
        for shape in (tip, bar):
            shape.CreateDisplayColorAttr([self.Gf.Vec3f(*colour)])

    def _xform(self, name: str, pose: Array) -> Any:
        made = self.Geom.Xform.Define(self.stage, name)
        # USD's vectors are rows, so that its matrices are the transposed ones
        made.AddTransformOp().Set(self.Gf.Matrix4d(*pose.T.ravel().tolist()))
        return made.GetPrim()
