"""Interrupts at a chosen step of a command."""

import os
import signal

from sim_validate.commands.console import Steps


def interrupt_once(monkeypatch, title="planning"):
    """Send this process an interrupt at the first step of some long work."""
    update, sent = Steps.update, []

    def interrupting(self, *given, **named):
        update(self, *given, **named)
        if self.title == title and not sent:
            sent.append(title)
            os.kill(os.getpid(), signal.SIGINT)
            signal.sigtimedwait([], 1.0)  # lets Python run its handler

    monkeypatch.setattr(Steps, "update", interrupting)
