"""Which change is which: worse, better, within bands, or not to be compared."""

import dataclasses

import pytest

from sim_validate.baselines.baseline import Baseline, Entry
from sim_validate.baselines.compare import (
    OTHER_VERSIONS,
    Carried,
    Status,
    compare,
    failing,
)
from sim_validate.engine.traces import Outcome

ENTRY = Entry(
    id="c-0-1-2-3",
    contacts_sha256="1f",
    outcome=Outcome.HELD,
    wrenches=13,
    not_held=(),
    controls=4,
    controls_let_go=4,
    mismatches=0,
    critical_friction=0.2,
    simulated_critical_friction=0.2001,
    limit_n=3.0,
    simulated_limit_n=2.99,
    displacement_m=1e-5,
    rotation_rad=1e-4,
    noisy_trials=100,
    noisy_not_held=(3, 50),
    noisy_close=(7, 50),
)
BEFORE = Baseline(
    grasps_file="grasps.json",
    limit=None,
    object="wedge",
    content_sha256="ab",
    friction=0.5,
    planned_radius_m=None,
    settings={"setup": {"physics": {"timestep_s": 0.001}}, "seed": 0},
    versions={"graspproof": "1", "mujoco": "4.0.0", "machine": "x86_64", "numpy": "2"},
    arithmetic="as here",
    entries=(ENTRY,),
)
OTHERS = {"versions": {**BEFORE.versions, "mujoco": "4.1.0"}}
OTHER_ARITHMETIC = {"arithmetic": "as elsewhere"}
SLIPPED = {"outcome": Outcome.SLIPPED, "not_held": ("weakest",)}


def now(header=None, **changed):
    entry = dataclasses.replace(ENTRY, **changed)
    return dataclasses.replace(BEFORE, entries=(entry,), **(header or {}))


def found(after, before=BEFORE):
    (finding,) = compare(before, after)
    return finding


def test_nothing_changed():
    assert found(now()).status is Status.SAME
    assert found(now({"versions": {**BEFORE.versions, "numpy": "3"}})).status is Status.SAME
    assert found(now(OTHERS)).status is Status.SAME


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        ({"outcome": Outcome.SLIPPED, "not_held": ("+force_x",)}, "held -> slipped at +force_x"),
        ({"controls_let_go": 3}, "negative controls that were not let go: 0 -> 1"),
        ({"controls": 3, "controls_let_go": 3}, "negative controls: 4 -> 3"),
        ({"critical_friction": 0.22}, "critical_friction: 0.2 -> 0.22"),
        ({"simulated_critical_friction": None}, "simulated_critical_friction: 0.2001 -> None"),
        ({"limit_n": 2.7}, "limit_n: 3 -> 2.7"),
        ({"displacement_m": None}, "displacement_m: 1e-05 -> None"),
        ({"noisy_not_held": (3, 9, 50)}, "repeats with noise no longer held: 9"),
    ],
)
@pytest.mark.parametrize(
    "header", [{}, OTHER_ARITHMETIC, OTHERS], ids=["same", "rounding", "others"]
)
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
        {"noisy_not_held": (3,)}, {"noisy_not_held": (3, 7, 50)},
    ],
)  # fmt: skip
def test_small_differences_count_with_the_same_versions_only(changed):
    for header in ({}, OTHER_ARITHMETIC):
        assert found(now(header, **changed)).status in (Status.REGRESSED, Status.IMPROVED)
    within = found(now(OTHERS, **changed))
    assert within.status is Status.WITHIN
    assert not within.reasons
    assert len(within.differences) == 1


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
    assert found(now(OTHER_ARITHMETIC, **changed)).status is Status.WITHIN


def test_the_last_digits_do_not_count():
    close = now(critical_friction=0.2 * (1.0 + 5e-10), displacement_m=1e-5 + 5e-8)
    assert found(close).status is Status.WITHIN


def on_the_brink(friction=0.202):
    return dataclasses.replace(BEFORE, friction=friction)


@pytest.mark.parametrize("friction", [0.5, 0.202, 0.198])
def test_another_verdict_at_the_critical_friction_is_grey_with_other_versions(friction):
    header = {"friction": friction}
    before = on_the_brink(friction)
    close = abs(friction - 0.2) <= OTHER_VERSIONS.grey * friction
    assert close == (friction != 0.5)
    wanted = Status.GREY if close else Status.REGRESSED
    with_it = {"displacement_m": 0.1, "rotation_rad": 1.0, "mismatches": 1}
    assert found(now(header | OTHERS, **SLIPPED, **with_it), before).status is wanted
    assert found(now(header, **SLIPPED), before).status is Status.REGRESSED


@pytest.mark.parametrize(
    "damage",
    [
        {"outcome": Outcome.DIVERGED}, {"outcome": Outcome.INVALID_START},
        {"controls_let_go": 3}, {"mismatches": 2}, {"critical_friction": 0.9},
        {"simulated_critical_friction": None}, {"noisy_not_held": (3, 4, 50)}, {"limit_n": 1.0},
    ],
)  # fmt: skip
def test_the_grey_zone_excuses_nothing_else(damage):
    after = now({"friction": 0.202} | OTHERS, **(SLIPPED | damage))
    assert found(after, on_the_brink()).status is Status.REGRESSED


def test_where_it_slips_first_counts_and_each_wrench_does():
    before = dataclasses.replace(BEFORE, entries=(dataclasses.replace(ENTRY, **SLIPPED),))
    elsewhere = now(outcome=Outcome.SLIPPED, not_held=("+force_x",))
    assert found(elsewhere, before).status is Status.REGRESSED
    more = found(now(outcome=Outcome.SLIPPED, not_held=("weakest", "lift")), before)
    assert more.status is Status.REGRESSED
    assert more.reasons == ("no longer held: lift",)


def test_grasps_that_are_refused_now_have_regressed():
    nothing = dataclasses.replace(BEFORE, entries=())
    (finding,) = compare(BEFORE, nothing, {ENTRY.id: "no room"})
    assert (finding.status, finding.reasons) == (Status.REGRESSED, ("refused: no room",))
    slippery = dataclasses.replace(nothing, friction=0.1)
    (finding,) = compare(BEFORE, slippery, {ENTRY.id: "not closed"})
    assert finding.status is Status.NOT_COMPARABLE
    assert finding.reasons == ("friction: 0.5 -> 0.1", "refused: not closed")


def test_grasps_of_another_object_are_not_just_missing():
    other = dataclasses.replace(ENTRY, id="a-new-one")
    header = {"content_sha256": "cd", "object": "cup"}
    listed = compare(BEFORE, dataclasses.replace(BEFORE, entries=(other,), **header))
    assert {finding.status for finding in listed} == {Status.NOT_COMPARABLE}
    assert listed[0].reasons == ("the object is another one: wedge -> cup",)


@pytest.mark.parametrize(
    ("header", "changed", "reason"),
    [
        ({"content_sha256": "cd"}, {}, "the object is another one"),
        ({"friction": 0.4}, {}, "friction: 0.5 -> 0.4"),
        ({"planned_radius_m": 0.004}, {}, "planned for: radius_m None -> 0.004"),
        ({"settings": {"setup": {"physics": {"timestep_s": 0.002}}, "seed": 0}}, {},
         "setup.physics.timestep_s: 0.001 -> 0.002"),
        ({"settings": {**BEFORE.settings, "seed": 1}}, {}, "seed: 0 -> 1"),
        ({}, {"contacts_sha256": "2e"}, "the contacts are others"),
    ],
)  # fmt: skip
def test_what_is_another_trial_is_not_compared(header, changed, reason):
    finding = found(now(header, **changed, **SLIPPED))
    assert finding.status is Status.NOT_COMPARABLE
    assert "held -> slipped at weakest" in finding.differences
    assert finding.reasons == (reason,) or reason in finding.reasons[0]


def test_grasps_that_are_gone_or_new_are_named():
    other = dataclasses.replace(ENTRY, id="a-new-one")
    after = dataclasses.replace(BEFORE, entries=(other,))
    assert [(each.id, each.status) for each in compare(BEFORE, after)] == [
        ("a-new-one", Status.NEW),
        ("c-0-1-2-3", Status.MISSING),
    ]


MOVED = Carried("part.obj has changed: face 3 moved 1.00 mm outward", {})
OTHER_PART = {"content_sha256": "cd"}


def on_another_part(**changed):
    after = now(OTHER_PART, contacts_sha256="2e", **changed)
    (finding,) = compare(BEFORE, after, carried=MOVED)
    return finding


@pytest.mark.parametrize(
    ("changed", "status", "word"),
    [
        ({}, Status.WITHIN, "same"),
        ({"critical_friction": 0.2 + 0.024 + 0.2 * 0.049}, Status.WITHIN, "same"),
        ({"critical_friction": 0.2 + 0.026 + 0.2 * 0.051}, Status.REGRESSED, "worse"),
        ({"limit_n": 3.0 * 1.06}, Status.IMPROVED, "better"),
        ({"controls": 3, "controls_let_go": 3}, Status.WITHIN, "same"),
        ({"controls_let_go": 3}, Status.REGRESSED, "worse"),
        (SLIPPED, Status.REGRESSED, "worse"),
    ],
)
def test_a_grasp_on_a_changed_part_is_compared_and_the_face_is_named(changed, status, word):
    """At friction 0.5 the band of critical frictions is 0.025 and 5 % of them."""
    finding = on_another_part(**changed)
    assert finding.status is status
    assert finding.reasons[0] == f"{word} on the changed part: {MOVED.change}"


def test_differences_show_the_digits_that_changed_and_their_band():
    finding = on_another_part(
        critical_friction=0.2 + 3.21e-7, limit_n=2.5432, displacement_m=1.2e-5
    )
    friction, limit, moved = finding.differences
    assert friction == "critical_friction: 0.2 -> 0.20000032 (+0.00016 %, band 0.035)"
    assert limit == "limit_n: 3 -> 2.543 (-15 %, band 0.15)"
    assert moved == "displacement_m: 1e-05 -> 1.2e-05 (+20 %, band 0.0002)"
    assert finding.beyond == (limit,)
    assert finding.reasons[1:] == (limit,)


def test_once_the_changed_part_has_a_baseline_it_is_compared_exactly():
    (finding,) = compare(BEFORE, now(limit_n=3.0001), carried=MOVED)
    assert finding.status is Status.IMPROVED
    (finding,) = compare(BEFORE, now(contacts_sha256="2e"), carried=MOVED)
    assert finding.status is Status.NOT_COMPARABLE


def test_a_grasp_that_does_not_exist_on_the_changed_part_is_gone():
    gone = dataclasses.replace(MOVED, gone={ENTRY.id: "finger 2 has lost face 3"})
    nothing = dataclasses.replace(BEFORE, entries=(), **OTHER_PART)
    (finding,) = compare(BEFORE, nothing, carried=gone)
    assert finding.status is Status.GONE
    assert finding.reasons == ("finger 2 has lost face 3", MOVED.change)
    assert Status.GONE in failing(strict=False)


def test_a_grasp_that_was_gone_already_when_the_baseline_was_written_is_the_same():
    gone = dataclasses.replace(MOVED, gone={"c-9-9-9-9": "finger 2 has lost face 3"})
    _, other = compare(BEFORE, now(), carried=gone)
    assert (other.id, other.status) == ("c-9-9-9-9", Status.SAME)
    (_, other) = compare(BEFORE, now(OTHER_PART), carried=gone)
    assert other.status is Status.GONE
