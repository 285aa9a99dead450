"""No search finds a false certificate that verifies; without a check, every search does."""

import pytest

from tests.attacks.searching import attacked
from tests.attacks.table import TABLE
from tests.tampering.table import TABLE as TAMPERED

LEAST = 20_000
"""Tries over all classes."""


@pytest.mark.long
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", TABLE)
def test_no_false_certificate_verifies(name, record_property):
    score = attacked(TABLE[name], TABLE[name].tries)
    record_property("tries", dict(score.tries))
    assert sum(score.tries.values()) == TABLE[name].tries
    assert min(score.tries.values()) >= 10
    assert score.raised == []
    assert [way for way, _ in score.accepted] == []


@pytest.mark.long
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", TABLE)
def test_the_search_finds_what_a_checker_without_a_check_accepts(name):
    for weaken in TABLE[name].weaken:
        with pytest.MonkeyPatch.context() as monkeypatch:
            weaken(monkeypatch)
            assert attacked(TABLE[name], TABLE[name].tries).accepted


def test_every_class_is_attacked_often_enough():
    assert {name for name in TAMPERED if name.isidentifier()} <= set(TABLE)
    assert sum(attack.tries for attack in TABLE.values()) >= LEAST
