"""What a file says about one contact set, enough to simulate its trials again."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact, Grasp
from sim_validate.simulation.setup import Agenda, Setup


@dataclass(frozen=True, slots=True)
class Wanted:
    """Which contact set of a file to replay."""

    grasp: str | None = None
    """Id of the grasp; it may be left out where there is only one."""
    control: str | None = None
    """Name of a negative control made from the grasp."""
    trial: int | None = None
    """Number of a repeat with noise."""
    grasps: Path | None = None
    """The grasps.json behind verdicts, if it is not beside them."""


@dataclass(frozen=True, slots=True, eq=False)
class Recorded:
    """A grasp, a negative control, or a repeat with noise, and how its trials ended."""

    name: str
    body: Polyhedron
    contacts: tuple[Contact, ...]
    friction: float
    setup: Setup
    agenda: Agenda
    """Which trials were run, with the noise that was drawn."""
    control: str | None = None
    """Name of the control; None for a grasp."""
    grasp: Grasp | None = None
    """The grasp, where the contacts are known as one."""
    trial: int | None = None
    """Number of the repeat with noise, if it is one."""
    outcomes: Mapping[str, str | None] = field(default_factory=dict[str, str | None])
    """How trials ended, by wrench; None where the file only says that the wrench was not held."""
    others: str | None = None
    """How all other trials ended; None if the file does not say."""

    def outcome_of(self, wrench: str) -> str | None:
        """How a trial ended; None if the file does not say."""
        return self.outcomes.get(wrench, self.others)

    @property
    def usual(self) -> str | None:
        """The first wrench that is known not to have been held, if any."""
        return next((name for name, end in self.outcomes.items() if end != "held"), None)
