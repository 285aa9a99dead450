from sim_validate.datasets.open_dataset import load_dataset as load_dataset
from sim_validate.execution.execute import execute as execute
from sim_validate.execution.jobs import ExecutedGrasp as ExecutedGrasp
from sim_validate.execution.settings import ExecutionSettings as ExecutionSettings
from sim_validate.execution.verdict import Execution as Execution
from sim_validate.execution.verdict import ExecutionTrial as ExecutionTrial
from sim_validate.hands.execute_hand import execute_hand as execute_hand
from sim_validate.hands.hand_verdict import HandVerdict as HandVerdict
from sim_validate.hands.validate_hand import hand_setup as hand_setup
from sim_validate.hands.validate_hand import validate_hand as validate_hand
from sim_validate.records.executions_json import Executions as Executions
from sim_validate.records.executions_json import load_executions as load_executions
from sim_validate.records.regions import load_regions as load_regions
from sim_validate.records.saved_verdicts import SavedVerdict as SavedVerdict
from sim_validate.records.saved_verdicts import SavedVerdicts as SavedVerdicts
from sim_validate.records.saved_verdicts import load_verdicts as load_verdicts
from sim_validate.records.transfers.saved_transfer import SavedCarriedGrasp as SavedCarriedGrasp
from sim_validate.records.transfers.saved_transfer import SavedTransfer as SavedTransfer
from sim_validate.records.transfers.saved_transfer import load_transfer as load_transfer
from sim_validate.reports.charts.margin_charts import margin_figure as margin_figure
from sim_validate.reports.charts.wrench_charts import wrench_figure as wrench_figure
from sim_validate.reports.report import write_report as write_report
from sim_validate.simulation.hold_verdict import Outcome as Outcome
from sim_validate.simulation.noise import Noise as Noise
from sim_validate.simulation.protocol import HoldProtocol as HoldProtocol
from sim_validate.simulation.setup import Agenda as Agenda
from sim_validate.simulation.setup import NamedWrench as NamedWrench
from sim_validate.simulation.setup import Setup as Setup
from sim_validate.validation.grasp_verdict import Verdict as Verdict
from sim_validate.validation.jobs import validate_all as validate_all
from sim_validate.validation.validation import (
    simulated_critical_friction as simulated_critical_friction,
)
from sim_validate.validation.validation import validate as validate
