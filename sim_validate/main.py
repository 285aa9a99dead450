"""Runs the `graspproof` command: turns arguments into flags, runs a command, returns an exit code.

This module imports nothing that is slow to load, so that help and usage errors answer at once.
"""

import gc
import sys
import traceback
from collections.abc import Sequence
from pathlib import Path
from pkgutil import resolve_name
from typing import Any, get_args

import tyro
from tyro.conf import FlagCreatePairsOff

from grasp_core.errors import GraspError, InputError
from grasp_core.kinds import FieldError
from sim_validate.baselines import flags as baseline_flags
from sim_validate.baselines.flags import Baseline
from sim_validate.datasets import flags as dataset_flags
from sim_validate.datasets.flags import Dataset
from sim_validate.hands.flags import Hand, Reach
from sim_validate.kit import command_flags as flags
from sim_validate.kit.exit_codes import (
    Exit,
    FlagsError,
    end_streams,
    exit_code,
    reason_of,
    steady_streams,
)
from sim_validate.kit.flag_values import REGISTRY, examples_for, flags_of, with_config
from sim_validate.kit.workers import interrupts_noted

Command = (
    flags.Run | flags.Plan | flags.Validate | flags.Execute | flags.Scene | flags.Export
    | flags.View | flags.Report | flags.Regions | flags.Replay | flags.Analyze | flags.Transfer
    | Reach | Hand | Dataset | Baseline | flags.Inspect | flags.Objects | flags.Doctor
)  # fmt: skip
COMMANDS = {kind.__name__.lower(): kind for kind in get_args(Command)}
"""The classes of flags, by the names of their commands."""
ACTIONS: dict[type[Any], str] = {
    flags.Run: "run:run_object",
    flags.Plan: "planning.plan:plan_file",
    flags.Validate: "protocols.command:judge_file",
    flags.Execute: "execution.command:execute_file",
    flags.Scene: "execution.command:write_scenes",
    flags.Export: "execution.command:export_grasps",
    flags.View: "report.command:view_grasp",
    flags.Report: "report.command:report_folder",
    flags.Regions: "planning.regions:certify_file",
    flags.Replay: "report.command:replay_trial",
    flags.Analyze: "planning.analyze:analyze_file",
    flags.Transfer: "planning.transfer:transfer_file",
    Reach: "protocols.command:judge_reach",
    Hand: "hands.command:show_hand",
    dataset_flags.Build: "datasets.command:build_dataset",
    dataset_flags.Import: "datasets.command:import_dataset",
    dataset_flags.Verify: "datasets.command:verify_dataset",
    dataset_flags.Export: "datasets.command:export_dataset",
    baseline_flags.Record: "baselines.command:record_baseline",
    baseline_flags.Check: "baselines.command:check_baseline",
    flags.Inspect: "planning.objects:inspect_object",
    flags.Objects: "planning.objects:list_objects",
    flags.Doctor: "closure.command:check_installation",
}
"""Module and function of each command. They are named as text, because planning must not wait until
a simulator is imported."""

COLLECTED_AFTER = 50_000
"""Number of new objects after which Python looks for unused circles of objects among them. It is
700 otherwise, and some per cent of the time of a plan would go into looking in vain."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the `graspproof` command with some arguments.

    Gives an exit code; see `Exit`.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    try:
        _check_working_folder()
        if "" in arguments:
            said = "an argument is empty, perhaps from a variable that is not set"
            raise FlagsError(f"{said}; leave the argument out, or give it a value")
        words = with_config(arguments, COMMANDS)
    except InputError as error:
        return _complain(str(error), exit_code(error))
    try:
        command: Command = tyro.cli(
            FlagCreatePairsOff[Command],  # type: ignore[valid-type]
            prog="graspproof",
            description=(
                "Four-finger force-closure grasps, proved and simulated. Every command also takes "
                "--config FILE.toml, whose keys are flags; flags given override it."
            ),
            args=words,
            registry=REGISTRY,
        )
    except SystemExit as stop:
        sys.stdout.write(examples_for(arguments))
        return stop.code if isinstance(stop.code, int) else Exit.USAGE
    except FieldError as error:
        names = (each.name for each in flags_of(Command)
                 if (each.owner, each.field) == (error.owner, error.name))  # fmt: skip
        flag = "--" + next(names, error.name).replace("_", "-")
        return _complain(f"{flag} {error.fault}", Exit.USAGE)
    except InputError as error:  # settings that do not fit each other
        return _complain(str(error), Exit.USAGE)
    except KeyboardInterrupt:
        return _complain("interrupted", Exit.INTERRUPTED)
    return _dispatch(command.action if isinstance(command, Dataset | Baseline) else command)


def _check_working_folder() -> None:
    try:
        Path.cwd()
    except OSError as error:  # nor could loops be compiled there
        raise InputError("the working folder is gone; change to one that exists") from error


def _dispatch(command: flags.Spoken) -> int:
    speech = command.speech
    try:
        with interrupts_noted():
            from sim_validate.kit.console import Reporter

            action = resolve_name(f"sim_validate.{ACTIONS[type(command)]}")
            code = action(command, Reporter(speech.quiet, speech.verbose, speech.json))
            if sys.stdout is not None:  # pyright: ignore[reportUnnecessaryComparison] - may be closed
                sys.stdout.flush()
            return code
    except KeyboardInterrupt:
        return _complain("interrupted", Exit.INTERRUPTED)
    except (GraspError, OSError) as error:
        return _complain(reason_of(error), exit_code(error))
    except Exception as error:
        if speech.verbose:
            traceback.print_exc()
        return _complain(f"internal error: {error!r}; -v shows where", Exit.INTERNAL)


def _complain(message: str, code: Exit) -> int:
    from sim_validate.kit.console import printable

    if sys.stderr is not None:  # pyright: ignore[reportUnnecessaryComparison] - may be closed
        sys.stderr.write(f"graspproof: {printable(message)}\n")
    return int(code)


def run_and_exit() -> None:
    """Run the `graspproof` command as a program, and exit with its exit code."""
    gc.set_threshold(COLLECTED_AFTER)
    steady_streams()
    code = main()
    end_streams()
    sys.exit(code)
