"""Simulate, judge, and compare with what the analysis predicts."""

from sim_validate.protocol import HoldProtocol as HoldProtocol
from sim_validate.validate import Verdict as Verdict
from sim_validate.validate import validate as validate
from sim_validate.verdict import Outcome as Outcome
