"""Compares plans, regions and verdicts under other arithmetic: BLAS, NumPy features, threads.

    python -m tests.benchmarks.machines [--quick] [--meshes FOLDER]

Each arithmetic stands for another machine: the environment of a process tells OpenBLAS, NumPy
and Numba which processor to work for. Every object is planned at every friction in each of them,
with all methods and a limit, and those of few faces without a limit; the first grasps are
simulated, get regions and are improved; the best grasps of objects of few faces are sought. All
must give what this machine's own arithmetic gives.
"""

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import time
import zlib
from pathlib import Path

import numpy as np

import grasp_core as gc
import scenes
import sim_validate as sv

FRICTIONS = (math.tan(math.radians(10.0)), 0.3, 0.5, 0.8)
LIMIT = 20
FEW_FACES = 12
"""Objects of so many faces are also planned without a limit."""
HULLS = tuple(f"random-{faces}-7" for faces in (8, 9, 10, 11, 12, 14, 16, 18, 24))
QUICK = ("box", "octahedron", "icosahedron", "l-bracket", "random-9-7")
SAME_PLACE = 1e-9
"""Contacts in object radii."""
SAME_FRICTION = 1e-7
SAME_FIGURE = 1e-6
"""Figures of simulations, regions and improved contacts may differ by this share."""
SAME_CORNER = 1e-7
"""Corners of regions, and improved contacts, in object radii."""
CONES = 2000
"""A proof of regions has at most this many cones."""


def arithmetics():
    """Environments by name; the first is the machine's own."""
    found = {"own": {}}
    for core in ("Haswell", "Nehalem", "Zen", "Sandybridge"):
        found[f"OpenBLAS for {core}"] = {"OPENBLAS_CORETYPE": core}
    found["NumPy without features"] = {"NPY_DISABLE_CPU_FEATURES": " ".join(dispatched())}
    found["Numba for any processor"] = {"NUMBA_CPU_NAME": "generic"}
    found["least of all"] = {
        "OPENBLAS_CORETYPE": "Nehalem",
        "NUMBA_CPU_NAME": "generic",
        "NPY_DISABLE_CPU_FEATURES": " ".join(dispatched()),
    }
    found["one thread"] = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1")
    found["two threads"] = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "2")
    return found


def dispatched():
    """Features of this processor that NumPy can do without."""
    module = np._core._multiarray_umath
    return [name for name in module.__cpu_dispatch__ if module.__cpu_features__.get(name)]


def objects(quick, meshes):
    """Names of built-in objects and paths of meshes."""
    built_in = [name for name in scenes.example_names() if name != "random-FACES-SEED"]
    names = QUICK if quick else (*built_in, *HULLS)
    kinds = {".ply", ".obj", ".stl", ".off"} if meshes else ()
    return [*names, *sorted(str(path) for kind in kinds for path in meshes.rglob(f"*{kind}"))]


def loaded(name):
    return gc.load_polyhedron(name) if Path(name).suffix else scenes.example_object(name)


def answers(names):
    """What is planned and simulated, by case, for JSON."""
    found = {}
    for name in names:
        body = loaded(name)
        for friction in FRICTIONS:
            plan = gc.plan(body, friction, limit=LIMIT)
            found[f"{name} at {friction:.4f}"] = [as_json(body, grasp) for grasp in plan.grasps]
            if friction == FRICTIONS[2] and plan.grasps:
                for kind in (simulated, regions, improved, best):
                    found[f"{name} {kind.__name__}"] = kind(body, plan.grasps[0], friction)
            if len(body.faces) <= FEW_FACES:
                every = gc.plan(body, friction).grasps
                found[f"all of {name} at {friction:.4f}"] = [as_json(body, g) for g in every]
    return found


def as_json(body, grasp):
    return {
        "id": grasp.id,
        "family": grasp.family,
        "faces": list(grasp.faces),
        "contacts": places(body, grasp.positions),
        "friction": grasp.critical_friction,
    }


def simulated(body, grasp, friction):
    verdict = sv.validate(body, grasp, friction)
    trials = [trial.hold.outcome for trial in verdict.wrenches]
    controls = [trial.let_go for trial in verdict.controls]
    return {
        "exact": [verdict.outcome, trials, controls],
        "figures": [verdict.critical_friction.simulated],
        "places": [],
    }


def regions(body, grasp, friction):
    found = gc.certify_regions(body, grasp, friction, max_cones=CONES)
    if found is None:
        return {"exact": None, "figures": [], "places": []}
    polygons = [region.polygon for region in found.regions]
    return {
        "exact": [len(found.cover.codes), found.cover.codes.tolist(), found.verify()],
        "figures": [found.radius, *(region.inscribed_radius for region in found.regions)],
        "places": places(body, np.vstack([*polygons, found.centers])),
    }


def improved(body, grasp, friction):
    found = gc.optimize_contacts(body, grasp, friction)
    return {
        "exact": [found.grasp.id, found.after.verify()],
        "frictions": [found.grasp.critical_friction],
        "places": places(body, found.grasp.positions),
    }


def best(body, _, friction):
    """The best grasp and its proof, which must be the same to the last bit."""
    if body.patches is not None or len(body.faces) > FEW_FACES:
        return {"exact": None, "figures": [], "places": []}
    found = gc.best_grasp(body, friction, gap=0.25, jobs=2)
    proof = found.proof
    numbers = b"".join(
        each.tobytes() for each in (proof.deeds, proof.asked, proof.twists, proof.lines)
    )
    return {
        "exact": [found.ended, found.bound, len(proof.deeds), zlib.crc32(numbers), found.verify()],
        "figures": [found.quality.lower],
        "places": places(body, found.grasp.positions),
    }


def places(body, points):
    """Points in object radii about the centre of mass, as numbers in a row."""
    return ((points - body.center_of_mass) / body.radius).ravel().tolist()


def differences(case, own, other):
    """How the answers of two arithmetics to one case differ, as sentences."""
    if isinstance(own, dict):
        if own["exact"] != other["exact"] or len(own["places"]) != len(other["places"]):
            return [f"{case}: {shown(own)} or {shown(other)}"]
        moved = np.abs(np.subtract(own["places"], other["places"])).max(initial=0.0)
        kinds = {"figures": (SAME_FIGURE, 0.0), "frictions": (0.0, SAME_FRICTION)}
        pairs = {kind: (own.get(kind, []), other.get(kind, [])) for kind in kinds}
        near = all(np.allclose(*pairs[kind], *slack) for kind, slack in kinds.items())
        if near and moved <= SAME_CORNER:
            return []
        return [f"{case}: {pairs['figures']}, {pairs['frictions']}, moved by {moved:.1e}"]
    if [g["id"] for g in own] != [g["id"] for g in other]:
        ids, others = ([g["id"] for g in each] for each in (own, other))
        at = next((i for i, (a, b) in enumerate(zip(ids, others, strict=False)) if a != b), None)
        return [f"{case}: {len(ids)} or {len(others)} grasps, "
                f"{len(set(ids) ^ set(others))} ids in one only, first at {at}"]  # fmt: skip
    found = []
    for one, two in zip(own, other, strict=True):
        moved = np.abs(np.subtract(one["contacts"], two["contacts"])).max()
        off = 0.0 if one["friction"] == two["friction"] else abs(one["friction"] - two["friction"])
        if one["faces"] != two["faces"] or one["family"] != two["family"]:
            found.append(f"{case}: {one['id']} has other fingers")
        elif not (moved <= SAME_PLACE and off <= SAME_FRICTION):
            found.append(f"{case}: {one['id']} is moved by {moved:.1e}, friction by {off:.1e}")
    return found


def shown(answer):
    """What must be the same in a case, in a line that can be read."""
    return f"{str(answer['exact'])[:120]} with {len(answer['places'])} coordinates"


def asked(environment, names):
    """The answers of a process with an environment."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "answers.json")
        command = [sys.executable, "-m", "tests.benchmarks.machines", "--answer", str(path)]
        subprocess.run([*command, *names], check=True, env={**os.environ, **environment})
        return json.loads(path.read_text())


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="five objects, two arithmetics")
    parser.add_argument("--meshes", type=Path, metavar="FOLDER", help="mesh files beside them")
    parser.add_argument("--answer", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("names", nargs="*", help="objects, instead of all")
    options = parser.parse_args()
    if options.answer:
        options.answer.write_text(json.dumps(answers(options.names)))
        return
    names = options.names or objects(options.quick, options.meshes)
    every = arithmetics()
    kept = ("least of all",) if options.quick else list(every)[1:]
    own, differing = asked({}, names), 0
    grasps = sum(len(each) for each in own.values() if isinstance(each, list))
    print(f"{len(names)} objects, {len(own)} cases, {grasps} grasps", flush=True)
    for arithmetic in kept:
        begun = time.perf_counter()
        other = asked(every[arithmetic], names)
        found = [line for case in own for line in differences(case, own[case], other[case])]
        differing += len(found)
        print(f"{arithmetic}: {len(found)} differences, {time.perf_counter() - begun:.0f} s")
        print(*(f"    {line}" for line in found[:40]), sep="\n", flush=True)
    if differing:
        sys.exit("plans or verdicts depend on the arithmetic")


if __name__ == "__main__":
    main()
