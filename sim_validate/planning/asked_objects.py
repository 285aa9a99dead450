"""Loads the object or the grasps that a command's flags name, and the fingers to plan for."""

from dataclasses import asdict, replace
from pathlib import Path

from grasp_core.errors import InputError
from grasp_core.mesh_files.limits import MeshLimits
from grasp_core.mesh_files.reading import FORMATS
from grasp_core.objects.polyhedron import Polyhedron, load_polyhedron
from grasp_core.planning.reach import Finger
from grasp_core.planning.result import Plan
from scenes.example_objects import example_object
from sim_validate.kit import flag_groups
from sim_validate.kit.console import Reporter
from sim_validate.planning.grasps_json import grasp_with_id, read_grasps


def load_object(name: str, mesh: flag_groups.Mesh) -> Polyhedron:
    """Load a mesh file, or a built-in object if the name has no mesh ending."""
    path = Path(name)
    if path.suffix.lower() == ".json":
        raise InputError(
            f"{name}: expected a mesh file or a built-in object, not a file of results; "
            "`graspproof view`, `validate` and `execute` read a grasps.json, and `graspproof "
            "report` shows the folder of a run"
        )
    if path.suffix.lower().lstrip(".") in FORMATS or path.is_file():
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
    if replace(mesh, choices=unlimited) != flag_groups.Mesh():
        raise InputError(
            f"{name} is a built-in object, so leave out --unit, --scale, --faces, --patches..., "
            "--flatness-m, --largest-part and --center-of-mass-m, which say how mesh files are read"
        )
    return example_object(name)


def object_to_plan(name: str, planning: flag_groups.Planning, reporter: Reporter) -> Polyhedron:
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


def asked_finger(planning: flag_groups.Planning) -> Finger | None:
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
    """Read the grasps that are asked for, and warn of what was changed in their mesh.

    They have another friction or seed where one is given. None, with a word about it, if the file
    holds no grasp.
    """
    saved = read_grasps(path)
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
