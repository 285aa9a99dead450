"""Tampering, counted: what is accepted and true, and what is accepted and false."""

import dataclasses
from collections import Counter

import numpy as np

import grasp_core as gc
from tests.tampering.changes import change_of, get, places, tampered


@dataclasses.dataclass
class Score:
    """What became of tampered certificates."""

    tries: Counter
    """By field."""
    accepted: int = 0
    """True by definition all the same."""
    false: list = dataclasses.field(default_factory=list)
    raised: list = dataclasses.field(default_factory=list)


def genuine(row, count, start=0):
    """Genuine certificates, (seed, certificate)."""
    seed = start
    while count:
        made = row.make(seed)
        if made is not None:
            yield seed, made
            count -= 1
        seed += 1


def attack(row, certificates, tries, rng):
    """Tamper with every field of certificates so many times in all, evenly."""
    score = Score(Counter())
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
            _judge(row, changed, (name, value), rng, score)
    return score


def _judge(row, changed, what, rng, score):
    try:
        accepted = changed.verify()
    except gc.InputError:
        return  # of wrappers: no contacts, no file
    except Exception as error:
        score.raised.append((*what, repr(error)))
        return
    if not isinstance(accepted, bool | np.bool_):
        score.raised.append((*what, f"verify gave {accepted!r}"))
    if accepted:
        try:
            true = row.true(changed, rng)
        except Exception as error:
            score.false.append((*what, changed, repr(error)))
            return
        score.accepted += bool(true)
        if not true:
            score.false.append((*what, changed, "false"))
