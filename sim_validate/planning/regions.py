"""Runs the command `regions`, which proves where each finger of a grasp may stand.

Certified regions of an object's grasps are held by one proof file each, and one `regions.json`.
"""

import hashlib
import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import computed_field

from grasp_core.allowed_values import FLAT, Count, NotNegative, Share, number, path_of
from grasp_core.arrays import Array, Shape, frozen, frozen_units
from grasp_core.closure.contacts import contacts_sha256
from grasp_core.closure.force_closure import force_closure
from grasp_core.declared import Declared, declared
from grasp_core.errors import InputError, SolverError, about
from grasp_core.figures import Shown, figures
from grasp_core.files.file_kinds import REGIONS
from grasp_core.geometry.polygons import FEWEST_CORNERS, edge_rows, plane_frame
from grasp_core.messages import MILLI
from grasp_core.names import Family
from grasp_core.objects.face_pieces import inscribed_radius
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.regions.certify_placement import misplacement, placement_bound
from grasp_core.regions.certify_regions import certify_regions
from grasp_core.regions.regions_certificate import CertifiedRegions, TwistCover
from grasp_core.stopping import Stop
from grasp_core.values import FINGERS, ContactRegion, Grasp, four
from sim_validate.commands import simulation_flags
from sim_validate.commands.console import Reporter
from sim_validate.commands.exit_codes import Exit
from sim_validate.files.array_files import read_arrays, write_arrays
from sim_validate.files.output_folders import alone_in
from sim_validate.files.result_files import AboutGrasps, AboutObject
from sim_validate.files.results_folder import remove_results
from sim_validate.planning.asked_objects import asked_grasps
from sim_validate.processes.own_faults import OWN_FAULTS
from sim_validate.processes.workers import each
from sim_validate.settings import Certifying

PROOFS = "proofs"
"""Folder of the proof files, beside `regions.json`."""
POLYGONS = tuple(f"region{i}_m" for i in range(FINGERS))
BORDERS = tuple(f"border{i}_m" for i in range(FINGERS))
FIELDS: Mapping[str, str] = {
    "normals": "normals", "friction": "friction", "origin": "origin_m", "depths": "depths_m",
    "scale": "scale_m", "centers": "centers_m", "radius": "disc_radius_m",
    "limit": "open_radius_m", "open_choice": "open_choice_m", "open_wrench": "open_wrench",
}  # fmt: skip
"""Name of the array in a proof file for fields of `CertifiedRegions`."""
ARRAYS = ("axes", "codes", "forces", *FIELDS.values(), *POLYGONS, *BORDERS)
MOST_REGION_CORNERS = 1000
SMALLEST_SCALE, LARGEST_SCALE = 1e-6, 1e6
"""Smallest and largest unit of length of a proof, and largest coordinate in it [m]."""


@declared
class ProofFile(Declared):
    """The file that proves a grasp's regions."""

    file: str
    """Its path, relative to the folder of `regions.json`."""
    sha256: str


FourRegions = tuple[ContactRegion, ContactRegion, ContactRegion, ContactRegion]
FingerPoints = Annotated[Array, Shape(FINGERS, 3)]


@declared
class GraspRegions(Declared):
    """The certified regions of one grasp, or the reason why it has none."""

    id: Annotated[str, Shown("grasp")]
    contacts_sha256: str
    """Hash of the contacts, which tells grasps of one id apart."""
    family: Annotated[Family, Shown("family")]
    planned_radius_m: Annotated[NotNegative, Shown("planned mm", ".3g", MILLI)]
    """Radius of the discs that the plan claims; 0.0 where it claims none [m]."""
    reason: str = ""
    """Why nothing was proved; empty if something was."""
    regions: FourRegions | None = None
    """Convex polygons in which each finger may stand; None if nothing was proved."""
    disc_radius_m: Annotated[NotNegative | None, Shown("disc mm", ".3g", MILLI)] = None
    """Radius of the discs that the regions hold, cut off at face borders [m]."""
    open_radius_m: Annotated[NotNegative | None, Shown("open mm", ".3g", MILLI)] = None
    """A larger radius, at which `open_choice_m` is not in force closure [m]; None if no such
    contacts were found."""
    open_choice_m: FingerPoints | None = None
    centers_m: FingerPoints | None = None
    """Centres of the discs."""
    normals: Annotated[Array, Shape(FINGERS, 3, units=True)] | None = None
    """Inward normals of the planes of the regions."""
    friction: Annotated[Array, Shape(FINGERS, least=0.0)] | None = None
    """Coulomb coefficient that the proof counts on, per finger."""
    cones: Annotated[Count | None, Shown("cones")] = None
    """Number of cones of the proof."""
    proof: ProofFile | None = None
    """The file with the proof; None if nothing was proved, or no folder was given."""
    closed_share: Annotated[Share | None, Shown("closed at least", ".3f")] = None
    """Proved lower bound of the chance that the grasp is closed when object, fingers and friction
    are off by the deviations that were asked for; None if none were, or if nothing was proved."""
    closed_share_reason: str = ""
    """Why no chance of closure was proved; empty if one was, or none was asked for."""

    @classmethod
    def of(
        cls, grasp: Grasp, proved: CertifiedRegions | str, proof: ProofFile | None
    ) -> "GraspRegions":
        """Record what was proved of a grasp, or the reason why nothing was."""
        named = (grasp.id, contacts_sha256(grasp.contacts), grasp.family, grasp.radius)
        if isinstance(proved, str):
            return cls(*named, reason=proved)
        return cls(
            *named,
            regions=proved.regions,
            disc_radius_m=proved.radius,
            open_radius_m=None if proved.open_choice is None else proved.limit,
            open_choice_m=proved.open_choice,
            centers_m=proved.centers,
            normals=proved.normals,
            friction=proved.friction,
            cones=len(proved.cover.forces),
            proof=proof,
        )

    def _check_together(self) -> None:
        shown = (self.disc_radius_m, self.centers_m, self.normals, self.friction, self.cones)
        if {each is None for each in (*shown, self.regions)} != {bool(self.reason)}:
            raise InputError(
                f"{self.id}: expected either regions with all of their figures, or a reason why "
                "there are none"
            )
        if self.closed_share is not None and self.closed_share_reason:
            raise InputError(f"{self.id}: expected a closed_share or a reason for none, got both")
        if any(len(each.polygon) < FEWEST_CORNERS for each in self.regions or ()):
            raise InputError(
                f"{self.id}: expected regions with at least {FEWEST_CORNERS} corners each"
            )

    @computed_field
    @property
    def inscribed_radius_m(self) -> Annotated[float | None, Shown("inner mm", ".3g", MILLI)]:
        """Radius of the smallest of the discs inscribed in the regions [m]."""
        return min((each.inscribed_radius for each in self.regions or ()), default=None)

    @computed_field
    @property
    def area_m2(self) -> Annotated[float | None, Shown("mm2", ".4g", MILLI**2)]:
        """Area of all four regions [m^2]."""
        return None if self.regions is None else sum(map(area_of, self.regions))


@declared
class Regions(AboutGrasps[GraspRegions]):
    """The certified regions of an object's grasps, as `regions.json` holds them."""

    FILE = REGIONS
    SCHEMA = 2

    certifying: Annotated[Certifying, FLAT]
    grasps: tuple[GraspRegions, ...]

    @computed_field
    @property
    def summary(self) -> Mapping[str, int]:
        """Numbers of grasps, and of grasps with regions."""
        proved = sum(each.regions is not None for each in self.grasps)
        return {"grasps": len(self.grasps), "proved": proved}


def write_proof(
    folder: Path | None, body: Polyhedron, grasp: Grasp, proved: CertifiedRegions | str
) -> ProofFile | None:
    """Write the proof of a grasp's regions to a folder, or remove an earlier one."""
    if folder is None:
        return None
    name = f"{PROOFS}/{grasp.id}.npz"
    if isinstance(proved, str):
        (folder / name).unlink(missing_ok=True)
        return None
    path = write_arrays(folder / name, proof_arrays(proved, grasp, body))
    return ProofFile(name, hashlib.sha256(path.read_bytes()).hexdigest())


def area_of(region: ContactRegion) -> float:
    """Compute the area of a convex region [m^2]."""
    sides = region.polygon[1:] - region.polygon[0]
    crossed = np.cross(sides[:-1], sides[1:])
    return 0.5 * float(np.linalg.norm(crossed.sum(axis=0)))


def proof_arrays(
    proved: CertifiedRegions, grasp: Grasp, body: Polyhedron
) -> dict[str, NDArray[Any]]:
    """Return the regions of a grasp and their proof, as arrays by name."""
    empty = {"open_choice": np.zeros((0, 3)), "open_wrench": np.zeros(0)}
    known = {field: getattr(proved, field) for field in FIELDS}
    polygons = [region.polygon for region in proved.regions]
    return {
        "grasp": np.array(grasp.id),
        "object_sha256": np.array(body.content_sha256),
        "axes": proved.cover.axes,
        "codes": proved.cover.codes.astype(np.uint8),
        "forces": proved.cover.forces,
        **{
            name: np.asarray(empty[field] if known[field] is None else known[field])
            for field, name in FIELDS.items()
        },
        **dict(zip((*POLYGONS, *BORDERS), (*polygons, *proved.borders), strict=True)),
    }


def load_regions(path: str | Path) -> CertifiedRegions:
    """Read regions and their proof, as `graspproof regions` writes them; nothing is verified yet.

    Raises:
        InputError: The file does not hold the proof of a grasp's regions.
    """
    path = path_of(path, "path")
    with about(f"{path}: expected a proof file as `graspproof regions` writes it"):
        return regions_of(read_arrays(path, ARRAYS))


def regions_of(kept: Mapping[str, NDArray[Any]]) -> CertifiedRegions:
    """Build regions and their proof from arrays by name; nothing is verified yet."""
    if missing := [name for name in ARRAYS if name not in kept]:
        raise InputError(
            f"the array {missing[0]} is missing; certify again with `graspproof regions`"
        )
    fields: dict[str, Any] = {field: np.asarray(kept[name])[()] for field, name in FIELDS.items()}
    for optional in ("open_choice", "open_wrench"):  # empty where nothing was found
        fields[optional] = fields[optional] if np.size(fields[optional]) else None
    scale = number(fields["scale"], "scale_m", ge=SMALLEST_SCALE, le=LARGEST_SCALE)
    normals = frozen_units(kept["normals"], (FINGERS, 3), "normals")
    forces = frozen(kept["forces"], (None, FINGERS, 3), "forces")
    return CertifiedRegions(
        regions=four(
            _region(name, kept[name], normal, scale)
            for name, normal in zip(POLYGONS, normals, strict=True)
        ),
        borders=four(kept[name] for name in BORDERS),
        cover=TwistCover(kept["axes"], kept["codes"], forces),
        **fields,
    )


def _region(name: str, given: NDArray[Any], normal: Array, scale: float) -> ContactRegion:
    polygon = frozen(given, (None, 3), name)
    if (
        not FEWEST_CORNERS <= len(polygon) <= MOST_REGION_CORNERS
        or np.abs(polygon).max() > LARGEST_SCALE
    ):
        raise InputError(
            f"{name}: expected a polygon of {FEWEST_CORNERS} to {MOST_REGION_CORNERS} corners "
            f"within {LARGEST_SCALE:g} m; certify the regions again"
        )
    try:
        with np.errstate(invalid="ignore", divide="ignore"):  # edges without length divide by zero
            arms = polygon / scale - polygon[0] / scale
            radius = scale * inscribed_radius(*edge_rows(arms @ plane_frame(normal)))
            return ContactRegion("certified", polygon, radius)
    except SolverError as error:
        raise InputError(
            f"{name}: expected the corners of a convex polygon in order; certify the regions again"
        ) from error


def certify_file(command: simulation_flags.RegionFlags, reporter: Reporter) -> int:
    """Certify independent contact regions for a file's grasps, and write them with their proofs."""
    saved = asked_grasps(
        command.grasps, reporter, grasp=command.grasp, friction=command.friction,
        limit=command.limit,
    )  # fmt: skip
    if saved is None:
        return Exit.NONE
    with alone_in(command.out):
        if command.out is not None:
            remove_results(command.out, REGIONS)
        found = certified(
            saved.body, saved.grasps, saved.friction, command.certifying, folder=command.out,
            jobs=command.jobs, stop=Stop(seconds=command.time_limit_s), reporter=reporter,
        )  # fmt: skip
    _show(found, reporter)
    reporter.document(found.document())
    if not found.complete:
        reporter.warn(f"the time limit ended the proofs after {len(found.grasps)} grasps")
        return Exit.PARTIAL
    proved = found.summary["proved"] == len(found.grasps)
    return Exit.GOOD if proved else Exit.NEGATIVE


def certified(
    body: Polyhedron, grasps: Sequence[Grasp], friction: float, asked: Certifying, *,
    folder: Path | None, jobs: int, stop: Stop, reporter: Reporter,
) -> Regions:  # fmt: skip
    """Certify regions in order, and write each proof when it is ready, if there is a folder."""
    proofs = each(partial(_certify, body, friction, asked), grasps, jobs=jobs, stop=stop)

    def recorded() -> Iterator[GraspRegions]:
        for grasp, (proved, chance) in zip(grasps, proofs, strict=False):  # fewer if stopped
            found = GraspRegions.of(grasp, proved, write_proof(folder, body, grasp, proved))
            yield replace(found, **chance)

    return reporter.collected(
        "certifying", recorded(), len(grasps), ("proved", lambda one: one.regions is not None),
        partial(Regions, AboutObject.of(body), friction, asked), folder, stop,
    )  # fmt: skip


def _certify(
    body: Polyhedron, friction: float, asked: Certifying, grasp: Grasp
) -> tuple[CertifiedRegions | str, dict[str, Any]]:
    """Certify the regions of a grasp, and bound the chance of closure if anything may be off."""
    try:
        return _certified(body, friction, asked, grasp), _chance(body, friction, asked, grasp)
    except OWN_FAULTS as error:
        return str(error), {}


def _chance(body: Polyhedron, friction: float, asked: Certifying, grasp: Grasp) -> dict[str, Any]:
    """Bound the chance of closure, or say why not, if anything may be off."""
    if not asked.misplacing:
        return {}
    off = misplacement(
        (friction, asked.friction_sigma), asked.off_mm / MILLI, math.radians(asked.off_deg),
        contact_sigma_m=asked.finger_mm / MILLI,
    )  # fmt: skip
    bounded = placement_bound(body, grasp, off)
    missing = isinstance(bounded, str)
    return {"closed_share_reason": bounded} if missing else {"closed_share": bounded.lower}


def _certified(
    body: Polyhedron, friction: float, asked: Certifying, grasp: Grasp
) -> CertifiedRegions | str:
    left = friction * (1.0 - asked.reserve)
    if not force_closure(grasp.positions, grasp.normals, left).closed:
        return f"not in force closure at friction {left:.6g}"
    proved = certify_regions(
        body, grasp, friction, reserve=asked.reserve, recenter=asked.recenter,
        clearance=asked.edge_clearance_m, max_cones=asked.max_cones,
    )  # fmt: skip
    return "no radius could be proved" if proved is None else proved


def _show(found: Regions, reporter: Reporter) -> None:
    reporter.records("independent regions", found.grasps)
    for figure in figures(GraspRegions):
        if figure.explained:
            reporter.say(f"{figure.shown.heading}: {figure.explained}")
    reasons = Counter(each.reason for each in found.grasps if each.reason)
    for reason, count in reasons.most_common():
        reporter.say(f"no regions for {count} of {len(found.grasps)} grasps: {reason}")
    unknown = Counter(each.closed_share_reason for each in found.grasps if each.closed_share_reason)
    for reason, count in unknown.most_common():
        reporter.say(
            f"no chance of closure proved for {count} of {len(found.grasps)} grasps: {reason}"
        )
    counted = [each.friction.min() for each in found.grasps if each.friction is not None]
    left = found.friction * (1.0 - found.certifying.reserve)
    if counted and min(counted) < left:
        reporter.say(
            f"the proofs use friction {min(counted):.4g} only, because curved faces lean from "
            "the planes that replace them"
        )


def wider(grasp: Grasp, found: GraspRegions) -> Grasp:
    """Give a grasp its certified regions if their discs around its contacts are larger."""
    if found.regions is None or found.normals is None:
        return grasp
    radius = min(  # how far each contact is from the nearest edge of its region
        float(edge_rows((region.polygon - contact.position) @ plane_frame(normal))[1].min())
        for region, contact, normal in zip(
            found.regions, grasp.contacts, found.normals, strict=True
        )
    )
    if radius <= grasp.radius and grasp.regions[0].kind != "point":
        return grasp
    return replace(grasp, regions=found.regions, radius=max(radius, 0.0))
