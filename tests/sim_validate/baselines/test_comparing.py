"""Which change is which: worse, better, within bands, or not to be compared."""

import dataclasses

import pytest

from sim_validate.baselines.comparing import Bands, Status, compare
from sim_validate.baselines.values import Baseline, Entry

ENTRY = Entry(
    id="c-0-1-2-3",
    contacts_sha256="1f",
    outcome="held",
    first_failure="",
    controls_held=0,
    mismatches=0,
    critical_friction=0.2,
    simulated_critical_friction=0.2001,
    limit_n=3.0,
    simulated_limit_n=2.99,
    displacement_m=1e-5,
    rotation_rad=1e-4,
    noisy_trials=100,
    noisy_held=80,
)
BEFORE = Baseline(
    grasps_file="grasps.json",
    object="wedge",
    content_sha256="ab",
    friction=0.5,
    settings={"setup": {"physics": {"timestep_s": 0.001}}, "seed": 0},
    versions={"graspproof": "1", "mujoco": "4.0.0", "machine": "x86_64", "numpy": "2"},
    arithmetic="as here",
    entries=(ENTRY,),
)
OTHERS = {"versions": {**BEFORE.versions, "mujoco": "4.1.0"}}
ROUNDING = {"arithmetic": "as elsewhere"}


def now(header=None, **changed):
    entry = dataclasses.replace(ENTRY, **changed)
    return dataclasses.replace(BEFORE, entries=(entry,), **(header or {}))


def found(after, before=BEFORE):
    (finding,) = compare(before, after)
    return finding


def test_nothing_changed():
    assert found(now()).status is Status.SAME
    assert found(now({"versions": {**BEFORE.versions, "numpy": "3"}})).status is Status.SAME


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        ({"outcome": "slipped", "first_failure": "+force_x"}, "held -> slipped at +force_x"),
        ({"controls_held": 1}, "negative controls that held: 0 -> 1"),
        ({"mismatches": 2}, "contradictions"),
        ({"critical_friction": 0.22}, "critical_friction: 0.2 -> 0.22"),
        ({"simulated_critical_friction": None}, "simulated_critical_friction: 0.2001 -> None"),
        ({"limit_n": 2.7}, "limit_n: 3 -> 2.7"),
        ({"simulated_limit_n": 2.5}, "simulated_limit_n"),
        ({"displacement_m": 1e-3}, "displacement_m"),
        ({"rotation_rad": 0.01}, "rotation_rad"),
        ({"noisy_held": 50}, "held with noise: 80 of 100 -> 50"),
    ],
)
@pytest.mark.parametrize("header", [{}, ROUNDING, OTHERS], ids=["same", "rounding", "others"])
def test_what_is_worse_is_a_regression_and_the_other_way_round_an_improvement(
    changed, reason, header
):
    finding = found(now(header, **changed))
    assert finding.status is Status.REGRESSED
    assert any(reason in text for text in finding.reasons)
    before = dataclasses.replace(BEFORE, entries=(dataclasses.replace(ENTRY, **changed),))
    assert found(now(header), before).status is Status.IMPROVED


@pytest.mark.parametrize(
    "changed",
    [
        {"critical_friction": 0.205}, {"simulated_critical_friction": 0.205}, {"limit_n": 2.95},
        {"displacement_m": 1.5e-4}, {"rotation_rad": 2e-3},
        {"noisy_held": 75},
    ],
)  # fmt: skip
def test_small_differences_count_with_the_same_versions_only(changed):
    assert found(now(**changed)).status is Status.REGRESSED
    assert found(now(ROUNDING, **changed)).status is Status.REGRESSED
    assert found(now(OTHERS, **changed)).status is Status.WITHIN


@pytest.mark.parametrize(
    "changed",
    [
        {"critical_friction": 0.2 * (1.0 + 5e-7)}, {"simulated_critical_friction": 0.2005},
        {"limit_n": 3.0 - 1e-6}, {"simulated_limit_n": 2.98}, {"displacement_m": 1e-5 + 5e-7},
        {"rotation_rad": 1e-4 + 5e-6},
    ],
)  # fmt: skip
def test_what_rounding_does_counts_on_processors_that_round_alike_only(changed):
    assert found(now(**changed)).status is Status.REGRESSED
    assert found(now(ROUNDING, **changed)).status is Status.WITHIN


def test_the_last_digits_do_not_count():
    close = now(critical_friction=0.2 * (1.0 + 5e-10), displacement_m=1e-5 + 5e-13)
    assert found(close).status is Status.WITHIN


@pytest.mark.parametrize("friction", [0.5, 0.202, 0.198])
def test_another_verdict_at_the_critical_friction_is_grey_with_other_versions(friction):
    header = {"friction": friction}
    before = dataclasses.replace(BEFORE, **header)
    slips = {"outcome": "slipped", "first_failure": "weakest"}
    close = abs(friction - 0.2) <= Bands().grey * friction
    assert close == (friction != 0.5)
    wanted = Status.GREY if close else Status.REGRESSED
    assert found(now(header | OTHERS, **slips), before).status is wanted
    assert found(now(header, **slips), before).status is Status.REGRESSED


@pytest.mark.parametrize(
    ("header", "changed", "reason"),
    [
        ({"content_sha256": "cd"}, {}, "the object is another one"),
        ({"friction": 0.4}, {}, "friction: 0.5 -> 0.4"),
        ({"settings": {"setup": {"physics": {"timestep_s": 0.002}}, "seed": 0}}, {},
         "setup.physics.timestep_s: 0.001 -> 0.002"),
        ({"settings": {**BEFORE.settings, "seed": 1}}, {}, "seed: 0 -> 1"),
        ({}, {"contacts_sha256": "2e"}, "the contacts are others"),
    ],
)  # fmt: skip
def test_what_is_another_trial_is_not_compared(header, changed, reason):
    worse = {"outcome": "slipped", "first_failure": "weakest"}
    finding = found(now(header, **changed, **worse))
    assert finding.status is Status.NOT_COMPARABLE
    assert finding.reasons == (reason,) or reason in finding.reasons[0]


def test_grasps_that_are_gone_or_new_are_named():
    other = dataclasses.replace(ENTRY, id="a-new-one")
    after = dataclasses.replace(BEFORE, entries=(other,))
    assert [(each.id, each.status) for each in compare(BEFORE, after)] == [
        ("a-new-one", Status.NEW),
        ("c-0-1-2-3", Status.MISSING),
    ]
