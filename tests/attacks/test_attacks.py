"""No search finds a false certificate that verifies; without a check, every search does."""

import pytest

from tests.attacks import best, contacts, faces, limits, wrench_sets
from tests.attacks.searching import attacked

TABLE = {
    "ClosureCertificate": contacts.CLOSURE,
    "a closure certificate with torsion": contacts.SOFT,
    "FrictionInterval": contacts.FRICTION,
    "Absence": faces.ABSENCE,
    "TwistCover": faces.COVER,
    "CertifiedRegions": faces.REGIONS,
    "FerrariCanny": wrench_sets.QUALITY,
    "ResistedLoads": wrench_sets.LOADS,
    "WrenchLimit": limits.LIMIT,
    "BestSqueeze": limits.SQUEEZE,
    "Payload": limits.PAYLOAD,
    "HandPayload": limits.HAND,
    "CutTree": best.TREE,
    "BestGrasp": best.BEST,
}


@pytest.mark.long
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", TABLE)
def test_no_false_certificate_verifies(name):
    score = attacked(TABLE[name], TABLE[name].tries)
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
