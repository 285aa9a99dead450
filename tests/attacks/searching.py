"""Searches for false certificates that verify: each forges claims that an oracle knows to be false.

A forger yields certificates without end, and every one of them is false: its claim is moved past
the truth, by growing amounts, and its other fields are repaired until each check in turn is met as
nearly as the forger can. What is false is known beforehand, by closed forms, by rational arithmetic
or by conic programs, never by the checker.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import cycle, islice
from typing import Any

import numpy as np

import grasp_core as gc


@dataclass(frozen=True)
class Attack:
    """A search for false certificates of one class."""

    ways: tuple[Callable[[np.random.Generator], Callable[[], Any] | None], ...]
    """Forgers: each gives a function that makes a false certificate, or None."""
    weaken: tuple[Callable[[Any], None], ...]
    """Each takes one check out of the checker, given pytest's monkeypatch; false claims verify
    then."""
    tries: int = 2000


@dataclass
class Score:
    """What became of false certificates."""

    tries: Counter = field(default_factory=Counter)
    """By way of forging, or by field."""
    accepted: list = field(default_factory=list)
    raised: list = field(default_factory=list)


def attacked(attack, tries):
    """Try so many false certificates, of each way in turn."""
    score, rng = Score(), np.random.default_rng(0)
    forged = ((way.__name__, way(rng)) for way in cycle(attack.ways))
    for way, make in islice((each for each in forged if each[1] is not None), tries):
        score.tries[way] += 1
        try:
            with np.errstate(all="ignore"):
                made = make()
            accepted = made.verify()
        except gc.InputError:
            continue  # such arrays are no certificate
        except Exception as error:
            score.raised.append((way, repr(error)))
            continue
        if accepted:
            score.accepted.append((way, made))
    return score


def power(rng, low, high):
    """A number whose logarithm is spread evenly."""
    return 10.0 ** rng.uniform(low, high)


def tiny(rng, size):
    """Small whole numbers times a power of two, mostly the smallest number that there is."""
    most = int(rng.choice([1, 2, 9]))
    places = int(rng.choice([1074, 1073, 1070, rng.integers(500, 1074)]))
    return np.ldexp(rng.integers(-most, most + 1, size=size).astype(float), -places)


def always(answer):
    """A function that answers the same to anything."""
    return lambda *_, **__: answer
