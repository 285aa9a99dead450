"""No certificate that was tampered with is accepted, unless it is true all the same."""

import ast
import zlib
from pathlib import Path

import numpy as np
import pytest

import grasp_core
import scenes
import sim_validate
from tests.tampering.changes import places
from tests.tampering.table import INTERFACES, TABLE
from tests.tampering.trying import attack, genuine

QUICK, FULL = 150, 3_000
"""Tries of a row of weight one."""
EVERYDAY = {
    "ClosureCertificate", "a closure certificate with torsion", "FrictionInterval", "TwistCover",
    "WrenchLimit", "a wrench limit with torsion",
}  # fmt: skip
"""Rows that take less than a second; all others are slow."""


def certificates(name, count):
    return [made for _, made in genuine(TABLE[name], count)]


def check(name, tries, count):
    rng = np.random.default_rng(zlib.crc32(name.encode()))
    made = certificates(name, count)
    assert all(each.verify() for each in made)
    assert all(TABLE[name].true(each, rng) for each in made)
    score = attack(TABLE[name], made, round(TABLE[name].weight * tries), rng)
    assert score.raised == []
    assert [found[:2] for found in score.false] == []
    assert set(score.tries) == {place for each in made for place in places(each)}
    assert min(score.tries.values()) > 0
    return score


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[pytest.mark.slow] * (name not in EVERYDAY)) for name in TABLE],
)
def test_nothing_false_is_accepted(name):
    score = check(name, QUICK, 4)
    assert sum(score.tries.values()) >= TABLE[name].weight * QUICK


@pytest.mark.long
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", TABLE)
def test_nothing_false_is_accepted_in_many_tries(name):
    """Some 22,000 over all rows."""
    score = check(name, FULL, 40)
    assert min(score.tries.values()) >= 10


def test_the_table_is_complete():
    """Every class of the packages that has `verify`."""
    found = set()
    for package in (grasp_core, scenes, sim_validate):
        for path in Path(package.__file__).parent.rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.ClassDef):
                    names = {part.name for part in node.body if isinstance(part, ast.FunctionDef)}
                    found |= {node.name} if "verify" in names else set()
    assert found - INTERFACES == {name for name in TABLE if name.isidentifier()}
