"""How many of so many: what a count says about a share, and whether two counts say another."""

import importlib
from typing import Any

CONFIDENCE = 0.95
SIGNIFICANT = 0.01
"""Two counts differ if chance alone would put them so far apart more rarely than this."""


def interval(count: int, of: int) -> tuple[float, float]:
    """Where the share behind a count is with 95 % confidence (Clopper and Pearson, exact).

    Args:
        count: How many did.
        of: How many were tried, at least one.
    """
    found = _stats().binomtest(count, of).proportion_ci(CONFIDENCE, method="exact")
    return float(found.low), float(found.high)


def differ(one: tuple[int, int], other: tuple[int, int]) -> bool:
    """Whether two counts, each with how many were tried, are of different shares (Fisher)."""
    table = [[count, of - count] for count, of in (one, other)]
    return bool(_stats().fisher_exact(table).pvalue < SIGNIFICANT)


def _stats() -> Any:
    """SciPy's statistics, which has no types and takes half a second to import."""
    return importlib.import_module("scipy.stats")
