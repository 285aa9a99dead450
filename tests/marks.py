"""Marks for more cases of what a lighter case covers, one of every day or of the slow slice."""

import pytest

MORE = (pytest.mark.slow, pytest.mark.more)
"""Marks of cases that are slow and that `.ci/run` leaves out, as it runs a lighter one."""


def more(*cases):
    """Cases of one parameter each, so marked."""
    return [pytest.param(case, marks=MORE) for case in cases]
