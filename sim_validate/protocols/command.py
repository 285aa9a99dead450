"""Runs `validate`: by our trials, or by published tests."""

import importlib
from typing import Any

from sim_validate.closure.command import prepared, simulate_grasps
from sim_validate.commands.console import Reporter
from sim_validate.commands.exit_codes import Exit, FlagsError
from sim_validate.commands.simulation_flags import ValidateFlags
from sim_validate.files.output_folders import alone_in
from sim_validate.planning.asked_objects import asked_grasps


def validate_file(command: ValidateFlags, reporter: Reporter) -> int:
    """Simulate the grasps of a file, or judge them by published tests, and report which hold."""
    chosen = asked_grasps(
        command.grasps, reporter, friction=command.friction, seed=command.seed, limit=command.limit
    )
    if chosen is None:
        return Exit.NONE
    if command.testing.traces and command.out is None:
        raise FlagsError("--traces writes files: give their folder with --out DIR too")
    setup, agenda = prepared(command.testing, chosen.finger, chosen.seed)
    with alone_in(command.out):
        if command.protocol:  # published tests are for hands, too, which our trials do not need
            judging: Any = importlib.import_module("sim_validate.protocols.judging_command")
            code, found = judging.judge_grasps(command, chosen, setup, reporter)
        else:
            code, found = simulate_grasps(
                chosen, setup, agenda, jobs=command.testing.jobs, folder=command.out,
                reporter=reporter,
            )  # fmt: skip
    reporter.document(found.document())
    return code
