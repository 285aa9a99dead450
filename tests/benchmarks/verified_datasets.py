"""Datasets of scanned objects, turned and of sizes from 1 mm to 2 m: built, they verify.

    python -m tests.benchmarks.verified_datasets FOLDER [--limit 1] [--sizes 0.001 2] [--jobs 1]

Every mesh file in FOLDER and in its folders is turned at random, scaled so that its longest side is
of each size, and put into one dataset per size by `graspproof dataset build`; then `graspproof
dataset verify` checks it, with one unit done again. Without FOLDER there is nothing to do.
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from grasp_core.mesh_files.limits import MeshLimits
from grasp_core.mesh_files.reading import FORMATS, read_triangles
from sim_validate.datasets.manifest import read_manifest
from sim_validate.main import main as graspproof

SIZES_M = (1e-3, 3e-2, 0.3, 2.0)
"""Longest sides."""


def turned(path, size, rng):
    """The text of an OBJ file of a mesh, turned, and of a size [m]."""
    mesh = read_triangles(path, MeshLimits())
    points = Rotation.random(rng=rng).apply(mesh.vertices - mesh.vertices.mean(axis=0))
    points *= size / np.ptp(points, axis=0).max()
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in points.tolist()]
    return "\n".join(lines + [f"f {i} {j} {k}" for i, j, k in (mesh.triangles + 1).tolist()]) + "\n"


def verified(paths, size, folder, options):
    """Build and verify a dataset of all meshes at a size; print what came of it."""
    meshes, dataset = folder / "meshes", folder / "dataset"
    meshes.mkdir(parents=True)
    rng = np.random.default_rng(0)
    for path in paths:
        (meshes / f"{path.stem}.obj").write_text(turned(path, size, rng))
    began = time.perf_counter()
    asked = ["--limit", str(options.limit), "--jobs", str(options.jobs), "-q"]
    built = graspproof(["dataset", "build", str(meshes), "--out", str(dataset), *asked])
    middle = time.perf_counter()
    checked = graspproof(["dataset", "verify", str(dataset), "-q"])
    ended = time.perf_counter()
    manifest = read_manifest(dataset)
    rows = manifest.rows()
    print(
        f"{size:8g} m  build {built}  verify {checked}  {manifest.quarantined} left out  "
        f"{rows['objects']} objects  {rows['grasps']} grasps and controls  "
        f"{middle - began:.0f} s and {ended - middle:.0f} s",
        flush=True,
    )
    return built == checked == 0


def main():
    """Print a line per size; fail where a dataset could not be built or verified."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--limit", type=int, default=1)
    parser.add_argument("--sizes", type=float, nargs="+", default=SIZES_M)
    parser.add_argument("--jobs", type=int, default=1)
    options = parser.parse_args()
    paths = sorted(p for p in options.folder.rglob("*") if p.suffix.lstrip(".").lower() in FORMATS)
    if not paths:
        print(f"skipped: {options.folder} holds no meshes")
        return
    print(f"{len(paths)} meshes, limit {options.limit}")
    with tempfile.TemporaryDirectory() as folder:
        good = [verified(paths, s, Path(folder) / f"{s:g}", options) for s in options.sizes]
    if not all(good):
        sys.exit("a dataset did not verify")


if __name__ == "__main__":
    main()
