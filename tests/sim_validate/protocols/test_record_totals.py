"""The totals of recorded grasps count them by what each of them says."""

import numpy as np
import pytest

from grasp_core.closure.force_closure import force_closure
from sim_validate.engine.held_or_let_go import Outcome
from sim_validate.protocols.verdict import (
    AboutHand,
    HandTrial,
    HeldLoad,
    RecordJudgement,
    RecordTotals,
    RunVerdict,
    TestOfRecord,
)

POINTS = np.array([[-1.0, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0]])
CLOSED, OPEN = (force_closure(POINTS[:count], -POINTS[:count], 0.5) for count in (4, 2))
HAND = AboutHand("h", "", ("a", "b"), [[0.0, 1.0], [0.0, 1.0]], ())


def trial(held, trusted=True):
    load = HeldLoad("x", 1.0, Outcome.HELD if held else Outcome.SLIPPED, "" if held else "a", 0.0)
    control = HeldLoad("c", 0.0, Outcome.SLIPPED if trusted else Outcome.HELD, "", 0.0)
    return HandTrial(4, 0.0, True, (load,), (control,), "")


def record(proof=CLOSED, passes=True, closed=True, tried=None, depth=0.0, links=("a",), joints=()):
    run = RunVerdict(0, passes, "" if passes else "fell", 0.0, 0.0, 4)
    return RecordJudgement(
        "r", "o", 1.0, "h", proof, "", links, depth, 2.0 * depth, 0.0, 0.0, 0.0, None, 0.0,
        (TestOfRecord("dexonomy", 0.1, closed, (run,)),), tried, joints or (0.5, 0.5),
    )  # fmt: skip


def totals(*records, unjudged=0, hand=HAND):
    return RecordTotals.of(records, unjudged, ("dexonomy",), hand)


def test_records_are_counted_by_their_verdicts():
    found = totals(
        record(tried=trial(True)),
        record(tried=trial(True), passes=False),
        record(tried=trial(False)),
        record(tried=trial(True, trusted=False), passes=False),
        record(proof=OPEN, closed=False),
        record(proof=OPEN, closed=True),
        record(proof=None, closed=None, passes=False),
        unjudged=3,
    )
    assert (found.records, found.judged, found.unjudged) == (10, 7, 3)
    assert (found.good, found.closed, found.open) == (1, 4, 2)
    assert (found.held, found.untrusted) == (2, 1)
    test = found.tests["dexonomy"]
    assert (test.passed, test.passed_but_open, test.held_but_failed) == (4, 1, 1)
    assert test.passed_but_lost == 1


def test_depths_have_quartiles_and_links_a_median():
    depths = [0.001 * k for k in range(5)]
    found = totals(*(record(depth=depth, links=("a", "a", "b")[: k + 1])
                     for k, depth in enumerate(depths)))  # fmt: skip
    assert found.depth_m == pytest.approx((0.001, 0.002, 0.003))
    assert found.own_depth_m == pytest.approx((0.002, 0.004, 0.006))
    assert found.links == 2.0


def test_diversity_is_over_all_records_of_the_hand():
    found = totals(record(joints=(0.1, 0.5)), record(joints=(0.9, 0.5)))
    assert found.joint_entropy == pytest.approx(np.log(2.0) / 2.0)
    assert found.joint_entropy_deviation == pytest.approx(np.log(2.0) / 2.0)


def test_of_no_records_there_are_no_figures():
    found = totals(unjudged=2, hand=None)
    assert (found.records, found.judged, found.tests["dexonomy"].passed) == (2, 0, 0)
    assert found.depth_m is found.links is found.joint_entropy is None
