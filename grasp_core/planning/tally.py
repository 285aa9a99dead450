"""Counts, while a method searches, of what becomes of its candidates."""

from collections import Counter
from typing import Literal, TypeAlias

from grasp_core.planning.result import MethodCounts

Counted: TypeAlias = Literal[
    "tried", "solved", "infeasible", "undecided", "duplicates", "found", "unreachable", "rejected"
]
"""The fields of `MethodCounts` that grow during a search."""


class Tally:
    """The counts of one method or of one attempt; only the owner changes them."""

    def __init__(self) -> None:
        self._counts = Counter[str]()

    def count(self, what: Counted, number: int = 1) -> None:
        """Raise one of the counts."""
        self._counts[what] += number

    def exclude(self, candidates: int, choices: int) -> None:
        """Count candidates whose bounds prove that they have no grasp.

        Args:
            candidates: Number of such candidates.
            choices: Number of choices of convex pieces that were bounded for this.
        """
        self.count("tried", candidates)
        self.count("infeasible", candidates)
        self.count("solved", choices)

    def add(self, other: "Tally") -> None:
        """Add the counts of an attempt."""
        self._counts.update(other._counts)

    def prune(self, every: int) -> None:
        """Count as pruned what was not tried of `every` candidate."""
        self._counts["pruned"] = every - self._counts["tried"]

    @property
    def counts(self) -> MethodCounts:
        """The counts as a frozen value."""
        return MethodCounts(**self._counts)
