"""Simulate, judge, and compare with what the analysis predicts.

Names are imported on first use: the command line's help must not wait for a simulator.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sim_validate.protocol import HoldProtocol as HoldProtocol
    from sim_validate.setup import Agenda as Agenda
    from sim_validate.setup import NamedWrench as NamedWrench
    from sim_validate.setup import Setup as Setup
    from sim_validate.validation import Verdict as Verdict
    from sim_validate.validation import simulated_critical_friction as simulated_critical_friction
    from sim_validate.validation import validate as validate
    from sim_validate.verdict import Outcome as Outcome

_HOMES = {
    "Agenda": "setup",
    "NamedWrench": "setup",
    "Setup": "setup",
    "simulated_critical_friction": "validation",
    "HoldProtocol": "protocol",
    "Verdict": "validation",
    "validate": "validation",
    "Outcome": "verdict",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"sim_validate.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted(_HOMES)
