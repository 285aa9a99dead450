"""The end of long work: its time, shared by phases, and interrupts."""

import math

import pytest

from grasp_core import stopping
from grasp_core.stopping import Stop, until


@pytest.fixture
def clock(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(stopping.time, "monotonic", lambda: now[0])
    return now


def test_phases_share_the_time_that_is_left(clock):
    whole = Stop(seconds=12.0)
    first = whole.part(3)
    assert first.left_s == 4.0
    clock[0] += 1.0  # the first phase is quick: others have more
    second = whole.part(2)
    assert second.left_s == pytest.approx(5.5)
    second.reserve(2.0)
    assert second.left_s == pytest.approx(3.5)
    clock[0] += 4.0
    assert first()
    assert second()
    assert not whole()
    assert second.why == "time"
    clock[0] += 7.0
    assert whole()
    assert whole.left_s == 0.0


def test_an_interrupt_ends_a_phase_and_the_whole():
    whole = Stop()
    part = whole.part(2).part(2)
    assert math.isinf(part.left_s)
    assert not part()
    whole.now()
    assert part()
    assert part.why == "interrupt"


def test_no_item_is_made_after_the_end():
    stop, made = Stop(nodes=2), []

    def items():
        for number in range(5):
            made.append(number)
            stop.spend(1)
            yield number

    assert list(until(stop, items())) == made == [0, 1]
    assert list(until(Stop(), range(3))) == [0, 1, 2]
