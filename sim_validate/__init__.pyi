from sim_validate.protocol import HoldProtocol as HoldProtocol
from sim_validate.setup import Agenda as Agenda
from sim_validate.setup import NamedWrench as NamedWrench
from sim_validate.setup import Setup as Setup
from sim_validate.validation import Verdict as Verdict
from sim_validate.validation import simulated_critical_friction as simulated_critical_friction
from sim_validate.validation import validate as validate
from sim_validate.verdict import Outcome as Outcome
