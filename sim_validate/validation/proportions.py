"""How many of so many: what a count says about a share."""

import importlib
from typing import Any

CONFIDENCE = 0.95


def interval(count: int, of: int) -> tuple[float, float]:
    """Where the share behind a count is with 95 % confidence (Clopper and Pearson, exact).

    Args:
        count: How many did.
        of: How many were tried, at least one.
    """
    found = _stats().binomtest(count, of).proportion_ci(CONFIDENCE, method="exact")
    return float(found.low), float(found.high)


def _stats() -> Any:
    """SciPy's statistics, which has no types and takes half a second to import."""
    return importlib.import_module("scipy.stats")
