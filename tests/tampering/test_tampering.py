"""No certificate that was tampered with is accepted, unless it is true all the same."""

import ast
import itertools
import zlib
from pathlib import Path

import numpy as np
import pytest

import grasp_core
import grasp_core as gc
import scenes
import sim_validate
from tests.attacks.searching import Score
from tests.tampering.changes import change_of, get, places, tampered
from tests.tampering.table import INTERFACES, TABLE

QUICK, FULL = 150, 3_000
"""Tries of a row of weight one."""
EVERYDAY = {
    "ClosureCertificate", "a closure certificate with torsion", "FrictionInterval", "TwistCover",
    "WrenchLimit", "a wrench limit with torsion",
}  # fmt: skip
"""Rows that take less than a second; all others are slow."""


def certificates(name, count):
    """Genuine certificates from the first seeds that make some."""
    made = (TABLE[name].make(seed) for seed in itertools.count())
    return list(itertools.islice((each for each in made if each is not None), count))


def attack(row, certificates, tries, rng):
    """Tamper with every field of certificates so many times in all, evenly."""
    score = Score()
    names = dict.fromkeys(name for c in certificates for name in places(c))
    while sum(score.tries.values()) < tries:
        for name in names:
            certificate, other = (certificates[i] for i in rng.integers(len(certificates), size=2))
            value, donor = get(certificate, name, rng), get(other, name, rng)
            try:
                with np.errstate(all="ignore"):
                    changed = tampered(
                        certificate, name, lambda v, d=donor: change_of(v, d, rng), rng
                    )
            except LookupError:
                continue  # this certificate has no such part
            except gc.InputError:
                score.tries[name] += 1
                continue
            score.tries[name] += 1
            judge(row, changed, (name, value), rng, score)
    return score


def judge(row, changed, what, rng, score):
    """Keep what is accepted though it is not true by definition, and errors that are not ours."""
    try:
        accepted = changed.verify()
    except gc.InputError:
        return  # of wrappers: no contacts, no file
    except Exception as error:
        score.raised.append((what, repr(error)))
        return
    if not isinstance(accepted, bool | np.bool_):
        score.raised.append((what, f"verify gave {accepted!r}"))
    try:
        false = accepted and not row.true(changed, rng)
    except Exception as error:
        false = repr(error)
    if false:
        score.accepted.append((what, false))


def check(name, tries, count):
    rng = np.random.default_rng(zlib.crc32(name.encode()))
    made = certificates(name, count)
    assert all(each.verify() for each in made)
    assert all(TABLE[name].true(each, rng) for each in made)
    score = attack(TABLE[name], made, round(TABLE[name].weight * tries), rng)
    assert score.raised == []
    assert score.accepted == []
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
            text = path.read_text(encoding="utf-8")
            for node in ast.walk(ast.parse(text if "def verify(" in text else "")):
                if isinstance(node, ast.ClassDef):
                    names = {part.name for part in node.body if isinstance(part, ast.FunctionDef)}
                    found |= {node.name} if "verify" in names else set()
    assert found - INTERFACES == {name for name in TABLE if name.isidentifier()}
