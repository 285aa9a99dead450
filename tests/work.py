"""Counts work in place of time, so that a test decides the same on every machine."""

import sys


def calls_of(run, *arguments):
    """Return how many functions are called, in Python or by it, while a function runs."""
    calls = 0

    def count(_frame, event, _argument):
        nonlocal calls
        calls += event in {"call", "c_call"}

    before = sys.getprofile()
    sys.setprofile(count)
    try:
        run(*arguments)
    finally:
        sys.setprofile(before)
    return calls
