"""Loads the object or the grasps that a command's flags name, and the fingers to plan for."""

from collections.abc import Iterable
from dataclasses import asdict, replace
from pathlib import Path

from grasp_core.errors import InputError
from grasp_core.mesh_files.limits import FORMATS, MeshLimits
from grasp_core.objects.polyhedron import Polyhedron, load_polyhedron
from grasp_core.planning.reach import Finger
from grasp_core.planning.result import Plan
from grasp_core.records.grasps_json import load_grasps
from grasp_core.values import Grasp
from scenes.example_objects import example_object
from sim_validate.commands import flags
from sim_validate.commands.console import Reporter

NAMED = 5
"""Largest number of names that a message lists."""


def is_mesh_file(name: str) -> bool:
    """Tell whether an object is a mesh file, by its ending or as it exists, or is built in."""
    path = Path(name)
    return path.suffix.lower().lstrip(".") in FORMATS or path.is_file()


def load_object(name: str, mesh: flags.Mesh) -> Polyhedron:
    """Load a mesh file, or a built-in object if the name has no mesh ending."""
    path = Path(name)
    if path.suffix.lower() == ".json":
        raise InputError(
            f"{name}: expected a mesh file or a built-in object, not a file of results; "
            "`graspproof view`, `validate` and `execute` read a grasps.json, and `graspproof "
            "report` shows the folder of a run"
        )
    if is_mesh_file(name):
        lengths, choices = mesh.lengths, mesh.choices
        return load_polyhedron(
            path, unit=lengths.unit, scale=lengths.scale, center_of_mass=mesh.center_of_mass_m,
            faces=choices.faces, patches=choices.patches, flatness_m=choices.flatness_m,
            largest_part=choices.largest_part, limits=choices,
        )  # fmt: skip
    if path.suffix or len(path.parts) > 1:
        raise InputError(
            f"{name}: expected a mesh file ({', '.join(FORMATS)}) or a built-in object; no such "
            "file exists"
        )
    unlimited = replace(mesh.choices, **asdict(MeshLimits()))
    if replace(mesh, choices=unlimited) != flags.Mesh():
        raise InputError(
            f"{name} is a built-in object, so leave out --unit, --scale, --faces, --patches..., "
            "--flatness-m, --largest-part and --center-of-mass-m, which say how mesh files are read"
        )
    return example_object(name)


def object_to_plan(name: str, planning: flags.Planning, reporter: Reporter) -> Polyhedron:
    """Load the object and check that the planning flags fit it."""
    if planning.ceiling is not None and not planning.optimize:
        raise InputError(
            "--ceiling needs --optimize, because it bounds the quality that moved contacts can "
            "reach"
        )
    kept = (planning.edge_clearance_m, planning.share_faces_m, planning.approach_m)
    if planning.optimize and any(kept):
        raise InputError(
            "--optimize moves contacts and would ignore --edge-clearance-m, --share-faces-m and "
            "--approach-m; leave out --optimize or these three flags"
        )
    if planning.regions and planning.share_faces_m is not None:
        raise InputError(
            "--regions and --share-faces-m exclude each other, because regions on one face could "
            "let fingers collide; leave one of the two flags out"
        )
    body = load_object(name, planning.mesh)
    if planning.optimize and body.patches:
        raise InputError(
            f"{body.name} has a curved surface, but --optimize needs exact planar faces; leave "
            "out --optimize"
        )
    for note in body.notes:
        reporter.warn(f"{body.name}: {note}")
    reporter.detail(f"{body.name}: mesh {body.content_sha256}, {len(body.triangles)} triangles")
    return body


def asked_finger(planning: flags.Planning) -> Finger | None:
    """Build the finger whose straight free path is planned, or None if no flag asks for it."""
    if planning.approach_m is None:
        if planning.finger_radius_m is not None and not planning.optimize:
            raise InputError(
                "--finger-radius-m also needs --approach-m, the length of the straight free path "
                "on which fingers approach, such as 0.05: about the object's size where fingers "
                "come from outside, or a few fingertip radii where they only close; or give "
                "--optimize, which keeps contacts the radius away from edges"
            )
        return None
    if planning.finger_radius_m is None:
        raise InputError("--approach-m also needs --finger-radius-m, the radius of the fingertips")
    return Finger(planning.finger_radius_m, planning.approach_m)


def asked_grasps(
    path: Path, reporter: Reporter, *, grasp: str | None = None, friction: float | None = None,
    seed: int | None = None, limit: int | None = None,
) -> Plan | None:  # fmt: skip
    """Read the grasps that are asked for, and warn of changes; None, with a word, without any."""
    saved = load_grasps(path)
    for note in saved.body.surface.notes():
        reporter.warn(f"{saved.body.name}: {note}")
    if not saved.grasps:
        absence = f"{path} holds no grasp"
        reporter.say(absence)
        reporter.document({"absence": absence})
        return None
    return replace(
        saved,
        friction=saved.friction if friction is None else friction,
        seed=saved.seed if seed is None else seed,
        grasps=saved.grasps[:limit] if grasp is None else (grasp_with_id(path, saved, grasp),),
    )


def grasp_with_id(path: Path, saved: Plan, wanted: str | None) -> Grasp:
    """Find the grasp with an id; the id may be left out if the file has one grasp only."""
    if wanted is None and len(saved.grasps) == 1:
        return saved.grasps[0]
    found = next((grasp for grasp in saved.grasps if grasp.id == wanted), None)
    if found is None:
        asked = (
            "choose a grasp with --grasp ID" if wanted is None else f"no grasp is named {wanted}"
        )
        raise InputError(
            f"{path}: {asked}; the file has {some(grasp.id for grasp in saved.grasps)}"
        )
    return found


def some(names: Iterable[str]) -> str:
    """List the first few of many names for a message."""
    listed = list(names)
    more = f" and {len(listed) - NAMED} more" if len(listed) > NAMED else ""
    return (", ".join(listed[:NAMED]) or "none") + more
