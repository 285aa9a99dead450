"""What checks of the simulator on known cases have in common, whatever is simulated.

A known case measures figures whose values are known and gives the interval in which each must lie.
Where one does not, nothing is simulated with the settings of the case. Fingertips that are put into
faces must touch them with the normals and depths of the faces; so must those of a grasp at its
start.
"""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Protocol

import numpy as np
from pydantic import computed_field

from grasp_core.allowed_values import Measured, OrInfinity
from grasp_core.arrays import Array
from grasp_core.declared import Declared, declared
from grasp_core.messages import MILLI
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.provenance import versions
from scenes.example_objects import example_object
from scenes.mujoco.closure_scene import Scene
from sim_validate.engine.stepping import Bench


@declared
class GateCheck(Declared):
    """One figure measured in simulation, and the interval in which it must lie."""

    name: str
    value: Measured
    """The measured figure, or NaN if it could not be measured."""
    least: float
    largest: OrInfinity

    @property
    def passed(self) -> bool:
        """Whether the measured figure lies in its interval."""
        return self.least <= self.value <= self.largest

    def __str__(self) -> str:
        state = "ok" if self.passed else "OUT OF TOLERANCE"
        return (
            f"{self.name}: {self.value:.6g} (from {self.least:.6g} to {self.largest:.6g}) {state}"
        )


@declared
class Gate(Declared):
    """The results of checking a version of MuJoCo on cases with known answers."""

    checks: tuple[GateCheck, ...]
    mujoco: str

    @computed_field
    @property
    def passed(self) -> bool:
        """Whether all checks passed."""
        return all(check.passed for check in self.checks)


class KnownCase(Protocol):
    """Settings with which a simulator is measured on cases with known answers."""

    def checks(self) -> tuple[GateCheck, ...]:
        """Measure all figures."""
        ...


@lru_cache(maxsize=256)
def measured(case: KnownCase) -> Gate:
    """Measure the simulator on a known case, once per process for the same settings."""
    return Gate(case.checks(), versions()["mujoco"])


def two_digits(value: float) -> float:
    """Round to two digits, so that what is nearly alike shares one measurement."""
    return float(f"{value:.1e}")


def near(name: str, ratio: float | None, tolerance: float) -> GateCheck:
    """Check that a measured figure, over the known one, is one; None if it was not measured."""
    return GateCheck(name, math.nan if ratio is None else ratio, 1.0 - tolerance, 1.0 + tolerance)


@lru_cache(maxsize=16)
def sized(name: str, radius_m: float) -> Polyhedron:
    """Scale an example object to a size, with its centre of mass at the origin."""
    example = example_object(name)
    vertices = (example.vertices - example.center_of_mass) * radius_m / example.radius
    return Polyhedron.from_mesh(vertices, example.triangles, name=name)


DEPTH = 1e-4
"""Depth to which rigid fingertips are put into the faces, in object radii. It is a thousand times
the rounding of a vertex coordinate, which meshes hold in single precision."""
NORMAL_ERROR = 1e-4
"""Largest angle between the normal of a contact and the normal of its face [rad]; the angle acts
like that much additional friction."""
DEPTH_ERROR = 0.1
"""Largest relative error of a contact's depth: vertices may be three hundredths of it off their
faces."""


def angles(normals: Array, faces: Array) -> Array:
    """Return the angles between normals and those of their faces, (k,) [rad]."""
    across = np.linalg.norm(np.cross(normals, faces), axis=1)
    return np.arctan2(across, np.einsum("ki,ki->k", normals, faces))


def untouching(bench: Bench[Scene], edges_m: Sequence[float] = ()) -> tuple[str, ...]:
    """List fingertips that do not touch the object at their start as their faces lie.

    `edges_m` are the distances of contacts from the edges of their faces [m], where known: there
    the surface, flat only to a mesh's digits, is farthest from the plane of its face.
    """
    normals, _ = bench.touched(bench.scene.layout.holder.tip_names, one=False)
    turned, found = angles(normals, bench.scene.layout.frames[:, :, 0]), list[str]()
    for finger in np.flatnonzero(~(turned <= NORMAL_ERROR)).tolist():
        edge = f", {MILLI * edges_m[finger]:.3g} mm from an edge of its face," if edges_m else ""
        fault = (
            "no contact is found; the mesh, flat only to its digits, may lie deeper there"
            if math.isnan(turned[finger])
            else f"the normal of its deepest contact is off by {turned[finger]:.3g} rad (at most "
            f"{NORMAL_ERROR:g} is allowed)"
        )
        found.append(
            f"in simulation, fingertip {finger}{edge} does not touch the object as planned: {fault}"
            "; plan with a larger --edge-clearance-m, use --surface pads, or raise ccd_iterations "
            "in the settings of the physics"
        )
    return tuple(found)


def touch_checks(
    normals: Array, faces: Array, depths: Array, where: str = ""
) -> tuple[GateCheck, GateCheck]:
    """Check contacts' normals beside those of their faces, and depths over the right ones.

    Figures are the largest errors; NaN where a fingertip has no contact, or several.
    """
    turned, off = angles(normals, faces), np.abs(depths - 1.0)
    normal = f"angle between a contact's normal and its face's{where}"
    depth = f"error of a contact's depth, relative to it{where}"
    return (
        GateCheck(normal, float(np.max(turned)), 0.0, NORMAL_ERROR),
        GateCheck(depth, float(np.max(off)), 0.0, DEPTH_ERROR),
    )
