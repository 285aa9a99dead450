"""Quadruples of directions that positively span (P3): compiled, in NumPy, and by the formula."""

import math
from itertools import combinations

import numpy as np

from grasp_core.cones.spanning import SpanningTable, span_sines
from tests.benchmarks.timing import compared, once
from tests.grasp_core.cones.reference_spanning import spanning_by_pairs

ANGLE = math.radians(10.0)
SIZES, LARGE = (12, 30, 100), (200, 400)
BLOCKS = 7


def directions(count, seed=0):
    units = np.random.default_rng(seed).normal(size=(count, 3))
    return units / np.linalg.norm(units, axis=1, keepdims=True)


def by_table(units):
    return SpanningTable(units, ANGLE).quadruples(0, len(units)).indices


def by_pairs(units):
    return spanning_by_pairs(units, math.sin(ANGLE)).indices


def by_formula(units):
    every = np.array(list(combinations(range(len(units)), 4)))
    return every[span_sines(units[every]) > math.sin(ANGLE)]


def rows():
    """The three ways, after they agreed on every size."""
    found = []
    for count in SIZES:
        ours = f"spanning quadruples of {count}, compiled"
        ways = {ours: by_table, "  NumPy, by pairs": by_pairs}
        if count <= 30:
            ways["  NumPy, closed form on each"] = by_formula
        units = directions(count)
        answers = [way(units) for way in ways.values()]
        assert all(np.array_equal(answers[0], other) for other in answers[1:])
        runs = {name: lambda block, way=way: len([way(each) for each in block])
                for name, way in ways.items()}  # fmt: skip
        remark = {ours: f"{len(answers[0])} of {math.comb(count, 4)}"}
        found += compared("enumeration", runs, [[units]] * BLOCKS, remark)
    for count in LARGE:
        what = f"spanning quadruples of {count}, compiled"
        timed, answer = once("enumeration", what, lambda n=count: by_table(directions(n)))
        found.append(timed.with_remark(f"{len(answer)} of {math.comb(count, 4)}"))
    return found
