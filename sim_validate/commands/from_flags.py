"""What the flags of a command ask for, as the values that the pipeline takes."""

from dataclasses import replace
from pathlib import Path

from grasp_core.errors import InputError
from grasp_core.mesh_files.limits import MeshLimits
from grasp_core.mesh_files.reading import FORMATS
from grasp_core.objects.face import PatchLimits
from grasp_core.objects.polyhedron import Polyhedron, load_polyhedron
from grasp_core.planning.reach import Finger
from scenes.example_objects import example_object
from scenes.fingertips import FingerSettings
from sim_validate.cli import flag_groups
from sim_validate.cli.console import Reporter
from sim_validate.cli.flag_bounds import FlagsError
from sim_validate.records.setup_toml import setup_from_file
from sim_validate.records.wrenches import weights, wrenches_from_file
from sim_validate.simulation.noise import Noise
from sim_validate.simulation.setup import Agenda, Setup, with_planned_radius


def load_object(name: str, mesh: flag_groups.Mesh) -> Polyhedron:
    """A mesh file, or a built-in object when the name has no mesh ending."""
    path = Path(name)
    if path.suffix.lower().lstrip(".") in FORMATS or path.is_file():
        given = mesh.limits
        return load_polyhedron(
            path,
            unit=mesh.unit,
            faces=mesh.faces,
            patches=PatchLimits(mesh.patch_spread_deg, mesh.patch_depth, mesh.patches),
            center_of_mass=mesh.center_of_mass_m,
            limits=MeshLimits(
                max_bytes=given.max_mesh_bytes,
                max_triangles=given.max_triangles,
                max_faces=given.max_faces,
                max_parts=given.max_parts,
                max_seconds=given.max_mesh_seconds,
                max_memory_mib=given.max_mesh_memory_mib,
            ),
        )
    if path.suffix or len(path.parts) > 1:
        raise InputError(f"{name}: no such file, and the ending is none of {', '.join(FORMATS)}")
    if replace(mesh, limits=flag_groups.MeshLimits()) != flag_groups.Mesh():
        raise InputError(
            f"{name} is built in; --unit, --faces, --patches, --patch-spread-deg, --patch-depth "
            "and --center-of-mass-m say how mesh files are read"
        )
    return example_object(name)


def object_to_plan(name: str, planning: flag_groups.Planning, reporter: Reporter) -> Polyhedron:
    """The object, once all that is asked for fits it.

    Raises:
        InputError: The object or a setting is refused.
    """
    if planning.ceiling is not None and not planning.optimize:
        raise InputError("--ceiling bounds what --optimize may reach; give both or neither")
    _check_optimize(planning)
    if planning.regions and planning.share_faces_m is not None:
        raise InputError(
            "--regions would let fingers that share a face meet; leave it or --share-faces-m out"
        )
    body = load_object(name, planning.mesh)
    if planning.optimize and body.patches:
        raise InputError(
            f"{body.name} has a curved surface; --optimize is for exact planar faces only"
        )
    for note in body.notes:
        reporter.warn(f"{body.name}: {note}")
    reporter.detail(f"{body.name}: mesh {body.content_sha256}, {len(body.triangles)} triangles")
    return body


def _check_optimize(planning: flag_groups.Planning) -> None:
    kept = (planning.edge_clearance_m, planning.share_faces_m, planning.approach_m)
    if planning.optimize and any(kept):
        raise InputError(
            "--optimize moves contacts without regard to --edge-clearance-m, --share-faces-m and "
            "--approach-m; leave it out, or them"
        )


def asked_finger(planning: flag_groups.Planning) -> Finger | None:
    """The fingers whose free lines are to be planned, if any."""
    if planning.approach_m is None:
        if planning.finger_radius_m is not None and not planning.optimize:
            raise InputError(
                "--finger-radius-m also needs --approach-m, the length of the free line on which "
                "fingers come, or --optimize, which keeps contacts that far from edges"
            )
        return None
    if planning.finger_radius_m is None:
        raise InputError("--approach-m also needs --finger-radius-m, the radius of the fingertips")
    return Finger(planning.finger_radius_m, planning.approach_m)


def finger_settings(given: flag_groups.Fingers) -> FingerSettings:
    """What the flags say about fingertips."""
    return FingerSettings(
        max_normal_force_n=given.max_normal_force,
        radius_m=given.fingertip_radius_m,
        mass_kg=given.fingertip_mass_kg,
        stiffness_n_per_m=given.stiffness_n_per_m,
        approach=given.approach,
    )


def noise_of(given: flag_groups.Repeats) -> Noise:
    """What the flags say about noise.

    Raises:
        InputError: There is noise, but no repeat to put it on.
    """
    plain = flag_groups.Repeats()
    if not given.trials and given != plain:
        raise FlagsError("--noise-... is for repeats: give --trials, too")
    return Noise(
        shift=given.noise_shift,
        turn_deg=given.noise_turn_deg,
        normal_deg=given.noise_normal_deg,
        friction=given.noise_friction,
        mass=given.noise_mass,
    )


def prepared(
    testing: flag_groups.Testing, planned: Finger | None, seed: int, folder: Path | None
) -> tuple[Setup, Agenda]:
    """What the flags and files say about trials, checked before anything runs.

    Args:
        testing: The flags.
        planned: Fingers that the grasps are planned for.
        seed: Seed of what is drawn.
        folder: Where results go, if anywhere.

    Raises:
        InputError: A flag or a file is refused, or flags contradict each other.
    """
    return _setup(testing, planned), _agenda(testing, seed, folder)


def _setup(testing: flag_groups.Testing, planned: Finger | None) -> Setup:
    """How the flags, and then a file, say trials are simulated."""
    setup = Setup(
        fingers=with_planned_radius(finger_settings(testing.fingers), planned),
        surface=testing.surface,
        timeout_s=testing.timeout_s,
    )
    return setup if testing.setup is None else setup_from_file(testing.setup, setup)


def _agenda(testing: flag_groups.Testing, seed: int, folder: Path | None) -> Agenda:
    """Which trials the flags ask for."""
    if testing.down and testing.weight_n is None:
        raise FlagsError("--down is a direction of the weight: give --weight-n too")
    if testing.traces and folder is None:
        raise FlagsError("--traces are written to files: give --out DIR too")
    own = () if testing.wrenches is None else wrenches_from_file(testing.wrenches)
    weight = () if testing.weight_n is None else weights(testing.weight_n, testing.down)
    return Agenda(
        random_wrenches=testing.random_wrenches,
        wrenches=(*own, *weight),
        limits=testing.limits,
        independent=testing.independent,
        rules=testing.also_judge_by,
        trials=testing.repeats.trials,
        noise=noise_of(testing.repeats),
        keep_traces=testing.traces,
        seed=seed,
    )
