"""The contents of a file about one contact set, enough to simulate its trials again."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.values import Contact, Grasp
from sim_validate.simulation.setup import Agenda, Setup


@dataclass(frozen=True, slots=True)
class Wanted:
    """Which contact set of a file is to be simulated again."""

    grasp: str | None = None
    """Id of the grasp; None if the file has only one."""
    control: str | None = None
    """Name of a negative control (contacts that must fail) made from the grasp."""
    trial: int | None = None
    """Number of a repeat with noise; None for the trials without noise."""
    grasps: Path | None = None
    """Path of the `grasps.json` that verdicts are about, if it is not beside them."""


@dataclass(frozen=True, slots=True, eq=False)
class Recorded:
    """A contact set of a file, and how its trials ended: a grasp, negative control, or repeat."""

    name: str
    body: Polyhedron
    contacts: tuple[Contact, ...]
    friction: float
    setup: Setup
    agenda: Agenda
    """Which trials were run, with the noise that was drawn."""
    control: str | None = None
    """Name of the negative control (contacts that must fail); None for a grasp."""
    grasp: Grasp | None = None
    """The planned grasp that has these contacts; None if it is not known."""
    trial: int | None = None
    """Number of the repeat with noise; None for trials without noise."""
    outcomes: Mapping[str, str | None] = field(default_factory=dict[str, str | None])
    """How trials ended, by name of the wrench; None where the file only says that it was not held.
    """
    others: str | None = None
    """How all trials that `outcomes` does not name ended; None if the file does not say."""

    def outcome_of(self, wrench: str) -> str | None:
        """Look up how the trial of a wrench ended; None if the file does not say."""
        return self.outcomes.get(wrench, self.others)

    @property
    def usual(self) -> str | None:
        """Choose the first wrench that was not held according to the file; None if all were."""
        return next((name for name, end in self.outcomes.items() if end != "held"), None)
