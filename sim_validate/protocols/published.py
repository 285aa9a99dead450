"""A published test of grasps as a value: loads, durations, thresholds, and where they are stated.

Fingers close and squeeze, then the object goes through runs, each from the squeezed grasp anew. A
run is a sequence of steps: a force on the object, a motion of the palm, or nothing. Directions are
those of the object's frame, whose z axis points up.
"""

import math
from dataclasses import dataclass, field
from itertools import chain
from typing import Literal, TypeAlias

import numpy as np

from grasp_core.arrays import Array
from grasp_core.by_value import summary
from grasp_core.objects.polyhedron import Polyhedron
from scenes.physics import PhysicsSettings
from scenes.tested.hand_scene import Weld

Triple: TypeAlias = tuple[float, float, float]
From: TypeAlias = Literal["before closing", "after closing", "each step"]
NOWHERE: Triple = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Source:
    """Files of a public repository, or a paper, in which a test is stated."""

    repository: str
    """Owner and name on GitHub."""
    commit: str
    """Commit that was read, in full."""
    paths: tuple[str, ...]
    """Files in it that state the numbers."""


@dataclass(frozen=True, slots=True)
class Step:
    """A part of a run: what acts on the object, and how the palm moves, for some time."""

    seconds: float
    pull_m_s2: Triple = NOWHERE
    """Force on the object over its mass [m/s^2]."""
    force_n: Triple = NOWHERE
    """Force on the object, whatever its mass [N]."""
    line_m: Triple = NOWHERE
    """Distance that the palm moves at constant speed [m]."""
    wave_m: Triple = NOWHERE
    """Amplitude of one sine of the palm [m]."""
    turn_deg: float = 0.0
    """Angle by which the palm turns about z at constant speed [deg]."""
    rises: bool = False
    """Whether the force rises from zero in proportion to time, or is there at once."""
    look_s: float | None = None
    """Time between looks at the object [s]; None to look at the end only."""

    def force(self, mass_kg: float) -> Array:
        """Return the force on an object of a mass, (3,) [N]."""
        return mass_kg * np.array(self.pull_m_s2) + np.array(self.force_n)


Run: TypeAlias = tuple[Step, ...]


@dataclass(frozen=True, slots=True)
class Passing:
    """When a run passes, and how many runs a grasp must pass."""

    most_m: float = math.inf
    """Displacement below which a look passes [m]."""
    most_deg: float = math.inf
    """Turn below which a look passes [deg]."""
    since: From = "before closing"
    """The pose of the object from which displacement and turn count."""
    fingers: int = 0
    """Least number of fingers that must touch the object at each look."""
    runs: int | None = None
    """Least number of runs that must pass; None for all."""
    most_overlap_m: float | None = None
    """Overlap of hand and object before closing up to which a grasp is tested at all [m]; None
    where the test does not ask."""


@dataclass(frozen=True, slots=True, repr=False)
class PublishedProtocol:
    """The test of another tool as it is published."""

    name: str
    version: str
    """Which version of the test: branch or paper."""
    sources: tuple[Source, ...]
    imitates: str
    """What MuJoCo cannot reproduce of it, as a sentence; empty for tests that run in MuJoCo."""
    ours: tuple[str, ...]
    """What is not as published here although it could be, or is not stated there; sentences."""
    friction: float
    timestep_s: float
    """Length of a step of its own simulator [s]."""
    runs: tuple[Run, ...]
    passing: Passing
    mass_kg: float | None = None
    """Mass of every object [kg]; None where it follows from a density."""
    density_kg_per_m3: float | None = None
    """Density of every object; None where the mass is stated or neither is."""
    close_s: float = 0.0
    """Time in which fingers move from the open grasp to the contacts [s]; 0 to start there."""
    squeeze_s: float = 0.0
    """Time in which fingers begin to push [s]; 0 for at once."""
    servo_n_m_per_rad: float = 5.0
    """Stiffness of the servos of a hand's joints."""
    own_servos: bool = False
    """Whether the hands that are known as `HandFile` have the stiffness of their files instead."""
    weld: Weld | None = None
    """What holds the root of a hand; None where its palm is fixed."""
    copies: int = 1
    """How often all runs are done, each time with the object displaced by noise."""
    noise_m: float = 0.0
    """Largest displacement by noise, along each axis [m]."""
    noise_deg: float = 0.0
    """Largest turn by noise, about each axis [deg]."""
    physics: PhysicsSettings = field(default_factory=PhysicsSettings)
    """Settings of MuJoCo: the published ones, or those that imitate them."""

    def __repr__(self) -> str:
        return summary("PublishedProtocol", self.label, self.version, runs=len(self.runs))

    @property
    def imitation(self) -> bool:
        """Return whether the test runs in a simulator other than MuJoCo."""
        return bool(self.imitates)

    @property
    def label(self) -> str:
        """Return the name as tables show it: imitations are called so."""
        return f"{self.name} (imitation)" if self.imitation else self.name

    def mass_of(self, body: Polyhedron) -> float:
        """Return the mass that an object has in this test [kg].

        Raises:
            InputError: The mass is that of a density, and the object's volume is not known.
        """
        if self.mass_kg is not None:
            return self.mass_kg
        density = ASSUMED_DENSITY if self.density_kg_per_m3 is None else self.density_kg_per_m3
        return body.mass_at(density)

    def forces(self, mass_kg: float) -> tuple[Array, ...]:
        """Return the different forces that act on an object of a mass, (3,) each [N]."""
        found: dict[Triple, Array] = {}
        for step in chain.from_iterable(self.runs):
            force = step.force(mass_kg)
            x, y, z = force.tolist()
            if force.any():
                found.setdefault((x, y, z), force)
        return tuple(found.values())


ASSUMED_DENSITY = 1000.0
"""Density of objects whose mass a test does not state [kg/m^3]: that of water."""
