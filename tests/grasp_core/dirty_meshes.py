"""Nine closed shapes, the ways in which files of them are dirty, and what must hold anyway."""

from dataclasses import dataclass
from functools import cache

import manifold3d
import numpy as np
import trimesh

import grasp_core as gc
import scenes
from grasp_core.errors import MeshRefusal
from tests.grasp_core import long_shapes

FAR = np.array([1.3, -1.1, 1.0])
"""Two metres away [m]."""
OVERLAP = 0.1
"""Thickness of the slab that two halves of a shape share, relative to its extent."""


@dataclass(frozen=True)
class Dirty:
    """The triangles of a shape as a careless program writes them."""

    vertices: np.ndarray
    triangles: np.ndarray
    moved: np.ndarray
    missing: float = 0.0
    """Share of the triangles that is missing."""


def _solid(mesh):
    return manifold3d.Manifold(
        manifold3d.Mesh64(
            np.array(mesh.vertices, dtype=np.float64, order="C"),
            np.array(mesh.faces, dtype=np.uint64, order="C"),
        )
    )


def _mesh(solid):
    made = solid.to_mesh64()
    return trimesh.Trimesh(
        np.asarray(made.vert_properties)[:, :3], np.asarray(made.tri_verts), process=False
    )


def _bumpy(base, seed):
    """A body with waves on it, turned out of the axes."""
    rng = np.random.default_rng(seed)
    size = np.ptp(base.vertices, axis=0).max()
    wave = 1.0 + 0.02 * np.sin(3.0 * base.vertices[:, :1] * (2.0 * np.pi / size) + seed)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    return trimesh.Trimesh(0.09 / size * base.vertices * wave @ turn, base.faces, process=False)


def _cup(wall, sides, steps):
    """A cup with a bottom, cut finely."""
    heights, radius = np.linspace(0.0, 1.0, steps), 0.4
    outside = [(radius, z) for z in heights]
    inside = [(radius - wall, z) for z in np.linspace(1.0, wall, steps)]
    return trimesh.creation.revolve(
        np.array([(0.0, 0.0), *outside, *inside, (0.0, wall)]), sections=sides
    )


@cache
def shapes():
    """The shapes by name: some with planar faces, some with curved surfaces."""
    found = {}
    for name in ("dodecahedron", "cross", "mug"):
        body = scenes.example_object(name)
        found[name] = trimesh.Trimesh(body.vertices, body.triangles, process=False)
    creation = trimesh.creation
    found["ball 0"] = _bumpy(creation.icosphere(subdivisions=3), 0)
    found["ring 0"] = _bumpy(creation.torus(1.0, 0.25, 40, 20), 0)
    found["capsule 4"] = _bumpy(creation.capsule(1.3, 0.4, count=[24, 24]), 4)
    found["cup 1"] = _bumpy(_cup(0.06, 40, 14), 1)
    found["cup 5"] = _bumpy(_cup(0.10, 40, 14), 5)
    found["pipe 6"] = _bumpy(long_shapes.pipe(16, 20, 60, 48, rings=12), 6)
    return found


def opened(mesh, share, seed):
    """The mesh without some triangles, one at least."""
    count = max(1, round(share * len(mesh.faces)))
    gone = np.random.default_rng(seed).choice(len(mesh.faces), count, replace=False)
    return np.delete(np.array(mesh.faces), gone, axis=0), count / len(mesh.faces)


def halves(mesh):
    """Two closed parts of the mesh that overlap, in one list of triangles."""
    solid, extent = _solid(mesh), np.ptp(mesh.vertices, axis=0).max()
    normal, middle = np.array([0.48, 0.6, 0.64]), mesh.vertices.mean(axis=0)
    parts = [
        _mesh(solid.trim_by_plane(list(sign * normal),
                                  float(sign * normal @ middle - 0.5 * OVERLAP * extent)))
        for sign in (1.0, -1.0)
    ]  # fmt: skip
    return trimesh.util.concatenate(parts)


def ways(mesh, seed):
    """The mesh, dirty in each way, by its name."""
    here, points, faces = np.zeros(3), np.array(mesh.vertices), np.array(mesh.faces)
    found = {"inside out": Dirty(points, faces[:, ::-1], here)}
    for name, share in (("1 triangle", 0.0), ("0.1 %", 0.001), ("1 %", 0.01)):
        left, missing = opened(mesh, share, seed)
        found[f"open by {name}"] = Dirty(points, left, here, missing)
    found["open and inside out"] = Dirty(points, left[:, ::-1], here, missing)
    rng = np.random.default_rng(seed)
    some = rng.random(len(faces)) < 0.3
    found["wound at random"] = Dirty(points, np.where(some[:, None], faces[:, ::-1], faces), here)
    parts = halves(mesh)
    found["in two parts"] = Dirty(np.array(parts.vertices), np.array(parts.faces), here)
    single = (points + FAR).astype(np.float32).astype(np.float64)
    found["2 m away in single precision"] = Dirty(single, faces, FAR)
    return found


def winding(mesh, points):
    """The winding number of a closed mesh about each point, by solid angles."""
    a, b, c = ((mesh.triangles[None, :, k] - points[:, None]) for k in range(3))
    la, lb, lc = (np.linalg.norm(side, axis=-1) for side in (a, b, c))
    volume = np.einsum("pti,pti->pt", a, np.cross(b, c))
    spread = la * lb * lc + (a * b).sum(-1) * lc + (b * c).sum(-1) * la + (c * a).sum(-1) * lb
    return np.arctan2(volume, spread).sum(axis=1) / (2.0 * np.pi)


def pushes_into(mesh, body, grasp, moved):
    """Whether each finger stands on the closed mesh and pushes into its material."""
    extent = np.ptp(mesh.vertices, axis=0).max()
    off = np.array([body.faces[face].depth for face in grasp.faces])
    off = (off + 1e-3 * extent)[:, None] * grasp.normals
    inside, outside = (
        winding(mesh, grasp.positions - moved + sign * off) for sign in (1.0, -1.0)
    )  # fmt: skip
    return (np.abs(inside - 1.0) < 1e-3) & (np.abs(outside) < 1e-3)


REFUSALS = {MeshRefusal.OPEN, MeshRefusal.OVERLAP, MeshRefusal.SEPARATE, MeshRefusal.WINDING,
            MeshRefusal.NON_MANIFOLD, MeshRefusal.NOT_FLAT}  # fmt: skip
"""What a dirty mesh may be refused for."""


def plan(body, limit):
    """The best concurrent grasps, all of them on faces and patches of their own."""
    return gc.plan(body, 0.5, families="concurrent", limit=limit).grasps
