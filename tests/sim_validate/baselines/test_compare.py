"""Which change is which: worse, better, within bands, or not to be compared."""

import dataclasses
import math

import pytest

from sim_validate.baselines.baseline import Baseline, How, KeptGrasp, VerdictFigures
from sim_validate.baselines.compare import OTHER_VERSIONS, Carried, Status, compare, failing
from sim_validate.engine.held_or_let_go import Outcome
from sim_validate.engine.setup import Agenda, NamedWrench, Setup
from sim_validate.files.result_files import AboutObject
from sim_validate.settings import HoldProtocol

FIGURES = VerdictFigures(
    outcome=Outcome.HELD, wrenches=13, not_held=(), controls=4, controls_held=0, mismatches=0,
    predicted_critical_friction=0.2, simulated_critical_friction=0.2001,
    limit_n=3.0, simulated_limit_n=2.99, displacement_m=1e-5, rotation_rad=1e-4,
    noisy_trials=100, noisy_not_held=(3, 50), noisy_close=(7, 50),
)  # fmt: skip
ENTRY = KeptGrasp("c-0-1-2-3", "1f", FIGURES)
BEFORE = Baseline(
    grasps_file="grasps.json", limit=None, object=AboutObject("wedge", "", "ab"), friction=0.5,
    planned_radius_m=None, settings=How(), arithmetic="as here", entries=(ENTRY,),
    versions={"graspproof": "1", "mujoco": "4.0.0", "machine": "x86_64", "numpy": "2"},
)  # fmt: skip
OTHERS = {"versions": {**BEFORE.versions, "mujoco": "4.1.0"}}
OTHER_ARITHMETIC = {"arithmetic": "as elsewhere"}
SLIPPED = {"outcome": Outcome.SLIPPED, "not_held": ("weakest",)}


def entry(name=ENTRY.id, contacts_sha256=ENTRY.contacts_sha256, **changed):
    return KeptGrasp(name, contacts_sha256, dataclasses.replace(FIGURES, **changed))


def now(header=None, **changed):
    return dataclasses.replace(BEFORE, entries=(entry(**changed),), **(header or {}))


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
        ({"outcome": Outcome.SLIPPED, "not_held": ("+force_x",)}, "no longer held: +force_x"),
        (SLIPPED, "outcome: held -> slipped"),
        ({"mismatches": 1}, "contradictions of the analysis: 0 -> 1"),
        ({"controls_held": 1}, "negative controls that were not let go: 0 -> 1"),
        ({"controls": 3}, "negative controls: 4 -> 3"),
        ({"predicted_critical_friction": 0.22}, "predicted_critical_friction: 0.2 -> 0.22"),
        ({"simulated_critical_friction": None}, "simulated_critical_friction: 0.2001 -> None"),
        ({"limit_n": 2.7}, "limit_n: 3 -> 2.7"),
        ({"displacement_m": math.nan}, "displacement_m: 1e-05 -> nan"),
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
    before = dataclasses.replace(BEFORE, entries=(entry(**changed),))
    assert found(now(header), before).status is Status.IMPROVED


@pytest.mark.parametrize(
    "changed",
    [
        {"predicted_critical_friction": 0.205}, {"simulated_critical_friction": 0.205},
        {"limit_n": 2.95},
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
        {"predicted_critical_friction": 0.2 * (1.0 + 5e-7)},
        {"simulated_critical_friction": 0.2005},
        {"limit_n": 3.0 - 1e-6}, {"simulated_limit_n": 2.98}, {"displacement_m": 1e-5 + 5e-7},
        {"rotation_rad": 1e-4 + 5e-6},
    ],
)  # fmt: skip
def test_what_rounding_does_counts_on_processors_that_round_alike_only(changed):
    assert found(now(**changed)).status is Status.REGRESSED
    assert found(now(OTHER_ARITHMETIC, **changed)).status is Status.WITHIN


def test_the_last_digits_do_not_count():
    close = now(predicted_critical_friction=0.2 * (1.0 + 5e-10), displacement_m=1e-5 + 5e-8)
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
        {"controls_held": 1}, {"mismatches": 2}, {"predicted_critical_friction": 0.9},
        {"simulated_critical_friction": None}, {"noisy_not_held": (3, 4, 50)}, {"limit_n": 1.0},
    ],
)  # fmt: skip
def test_the_grey_zone_excuses_nothing_else(damage):
    after = now({"friction": 0.202} | OTHERS, **(SLIPPED | damage))
    assert found(after, on_the_brink()).status is Status.REGRESSED


def test_where_it_slips_first_counts_and_each_wrench_does():
    before = dataclasses.replace(BEFORE, entries=(entry(**SLIPPED),))
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
    header = {"object": AboutObject("cup", "", "cd")}
    listed = compare(BEFORE, now(header, name="a-new-one"))
    assert {finding.status for finding in listed} == {Status.NOT_COMPARABLE}
    assert listed[0].reasons == ("the object is another one: wedge -> cup",)


@pytest.mark.parametrize(
    ("header", "changed", "reason"),
    [
        ({"object": AboutObject("wedge", "", "cd")}, {}, "the object is another one"),
        ({"friction": 0.4}, {}, "friction: 0.5 -> 0.4"),
        ({"planned_radius_m": 0.004}, {}, "planned for: radius_m None -> 0.004"),
        ({"settings": How(Setup(hold=HoldProtocol(hold_s=0.3)))}, {},
         "setup.hold.hold_s: 0.4 -> 0.3"),
        ({"settings": How(agenda=Agenda(seed=1))}, {}, "seed: 0 -> 1"),
        ({"settings": How(agenda=Agenda(wrenches=(NamedWrench("lift", [1.0] * 6),)))}, {},
         "wrenches.lift: None -> [1.0, 1.0, 1.0, 1.0, 1.0, 1.0]"),
        ({}, {"contacts_sha256": "2e"}, "the contacts are others"),
    ],
)  # fmt: skip
def test_what_is_another_trial_is_not_compared(header, changed, reason):
    finding = found(now(header, **changed, **SLIPPED))
    assert finding.status is Status.NOT_COMPARABLE
    assert "outcome: held -> slipped" in finding.differences
    assert finding.reasons == (reason,) or reason in finding.reasons[0]


def test_grasps_that_are_gone_or_new_are_named():
    after = now(name="a-new-one")
    assert [(each.id, each.status) for each in compare(BEFORE, after)] == [
        ("a-new-one", Status.NEW),
        ("c-0-1-2-3", Status.MISSING),
    ]


MOVED = Carried("part.obj has changed: face 3 moved 1.00 mm outward", {})
OTHER_PART = {"object": AboutObject("wedge", "", "cd")}


def on_another_part(**changed):
    after = now(OTHER_PART, contacts_sha256="2e", **changed)
    (finding,) = compare(BEFORE, after, carried=MOVED)
    return finding


@pytest.mark.parametrize(
    ("changed", "status", "word"),
    [
        ({}, Status.WITHIN, "same"),
        ({"predicted_critical_friction": 0.2 + 0.024 + 0.2 * 0.049}, Status.WITHIN, "same"),
        ({"predicted_critical_friction": 0.2 + 0.026 + 0.2 * 0.051}, Status.REGRESSED, "worse"),
        ({"limit_n": 3.0 * 1.06}, Status.IMPROVED, "better"),
        ({"controls": 3}, Status.WITHIN, "same"),
        ({"controls_held": 1}, Status.REGRESSED, "worse"),
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
        predicted_critical_friction=0.2 + 3.21e-7, limit_n=2.5432, displacement_m=1.2e-5
    )
    friction, moved, limit = finding.differences
    assert friction == "predicted_critical_friction: 0.2 -> 0.20000032 (+0.00016 %, band 0.035)"
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
