"""Interrupts that libraries swallow are raised all the same."""

import os
import signal
import sys

import pytest

from sim_validate.commands.console import Reporter
from sim_validate.processes.interrupts import check_interrupted, interrupts_noted


def swallow():
    """An interrupt, raised where somebody clears errors that are not theirs."""
    try:
        os.kill(os.getpid(), signal.SIGINT)
        signal.sigtimedwait([], 1.0)  # lets Python run its handler
    except KeyboardInterrupt:
        return
    pytest.fail("nothing was raised")


def test_a_swallowed_interrupt_is_raised_at_the_next_step():
    before = signal.getsignal(signal.SIGINT)
    with interrupts_noted():
        check_interrupted()
        swallow()
        with pytest.raises(KeyboardInterrupt), Reporter(True, False, False).progress("x") as steps:
            steps.update(1, 2)
        check_interrupted()  # raised once
    assert signal.getsignal(signal.SIGINT) is before


def test_interrupts_from_before_do_not_count():
    with interrupts_noted():
        swallow()
    with interrupts_noted():
        check_interrupted()


class Swallowing:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGTERM)
        signal.sigtimedwait([], 1.0)


def test_a_request_to_end_is_an_interrupt_and_where_it_is_swallowed_says_nothing(capsys):
    before = signal.getsignal(signal.SIGTERM), sys.unraisablehook
    with interrupts_noted():
        Swallowing()
        with pytest.raises(KeyboardInterrupt):
            check_interrupted()
    assert capsys.readouterr().err == ""
    assert (signal.getsignal(signal.SIGTERM), sys.unraisablehook) == before


def fail_without_what_was_swallowed():
    swallow()
    raise RuntimeError("what was swallowed is missing")


def test_an_error_after_a_swallowed_interrupt_is_that_interrupt():
    with pytest.raises(KeyboardInterrupt), interrupts_noted():
        fail_without_what_was_swallowed()
    with pytest.raises(RuntimeError), interrupts_noted():
        raise RuntimeError("nothing was swallowed")
