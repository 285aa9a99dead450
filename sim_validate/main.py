"""Runs the `graspproof` command: turns arguments into flags, runs a command, returns an exit code.

This module imports nothing that is slow to load, so that help and usage errors answer at once.
"""

import gc
import sys
import traceback
from collections.abc import Iterable, Sequence
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, get_args

import tyro
from tyro.conf import FlagCreatePairsOff

from grasp_core.compiled import why_not_kept
from grasp_core.errors import GraspError, InputError
from grasp_core.kinds import FieldError, near, shown
from grasp_core.settings import types
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
from sim_validate.kit.flag_values import (
    COMMAND_WORDS,
    REGISTRY,
    examples_for,
    flags_of,
    parts_of,
    with_config,
)
from sim_validate.kit.workers import interrupts_noted

if TYPE_CHECKING:
    from sim_validate.kit.console import Reporter

Command = (
    flags.Run | flags.Plan | flags.Validate | flags.Execute | flags.Scene | flags.Export
    | flags.View | flags.Report | flags.Regions | flags.Replay | flags.Analyze | flags.Transfer
    | Reach | Hand | Dataset | Baseline | flags.Inspect | flags.Objects | flags.Doctor
)  # fmt: skip
COMMANDS = {kind.__name__.lower(): kind for kind in get_args(Command)}
"""The classes of flags, by the names of their commands."""
PRODUCING = (flags.Plan, flags.Regions, flags.Transfer, Reach)
"""Commands of whose results the exit code says little."""
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
        if arguments == ["--version"]:
            print(_version())  # noqa: T201 - the result itself; a closed stream takes nothing
            return Exit.GOOD
        command = _parsed(arguments)
    except SystemExit as stop:
        sys.stdout.write(examples_for(arguments))
        return stop.code if isinstance(stop.code, int) else Exit.USAGE
    except InputError as error:
        return _complain(str(error), exit_code(error))
    except KeyboardInterrupt:
        return _complain("interrupted", Exit.INTERRUPTED)
    return _dispatch(command.action if isinstance(command, Dataset | Baseline) else command)


def _parsed(arguments: list[str]) -> Command:
    """Turn arguments into flags; the parser exits where help is asked for, or a flag is unknown."""
    _check_working_folder()
    if "" in arguments:
        said = "an argument is empty, perhaps from a variable that is not set"
        raise FlagsError(f"{said}; leave the argument out, or give it a value")
    _check_command(arguments)
    words = with_config(arguments, COMMANDS)
    try:
        return tyro.cli(
            FlagCreatePairsOff[Command],  # type: ignore[valid-type]
            prog="graspproof",
            description=(
                "Four-finger force-closure grasps, proved and simulated. Every command also takes "
                "--config FILE.toml, whose keys are flags; flags given override it. `graspproof "
                "--version` prints versions."
            ),
            args=words,
            registry=REGISTRY,
        )
    except FieldError as error:
        field = error.name.partition("[")[0]
        names = (each.name for each in flags_of(Command)
                 if (each.owner, each.field) == (error.owner, field))  # fmt: skip
        flag = "--" + next(names, field).replace("_", "-")
        raise FlagsError(f"{flag} {error.fault}") from error
    except InputError as error:  # settings that do not fit each other
        raise FlagsError(str(error)) from error


def _check_working_folder() -> None:
    try:
        Path.cwd()
    except OSError as error:  # nor could loops be compiled there
        raise InputError("the working folder is gone; change to one that exists") from error


def _check_command(arguments: Sequence[str]) -> None:
    """Refuse the name of a command that there is not, and suggest names like it."""
    names: Iterable[str] = COMMANDS
    most = COMMAND_WORDS.get(arguments[0], 1) if arguments else 0
    for place, word in enumerate(arguments[:most]):
        if word.startswith("-"):
            return
        if word not in names:
            asked = " ".join(arguments[: place + 1])
            hint = near(word, names) or f"the commands are {', '.join(names)}"
            raise FlagsError(f"there is no command {shown(asked)}; {hint}")
        parts = parts_of(types(COMMANDS[arguments[0]]).get("action"))
        names = [kind.__name__.lower() for kind in parts if kind in ACTIONS]


def _version() -> str:
    from grasp_core.provenance import versions

    found = versions()
    return ", ".join(f"{name} {found[name.lower()]}" for name in ("graspproof", "MuJoCo", "Python"))


def _dispatch(command: flags.Spoken) -> int:
    speech = command.speech
    try:
        with interrupts_noted():
            from sim_validate.kit.console import Reporter

            reporter = Reporter(speech.quiet, speech.verbose, speech.json)
            _warn(command, reporter)
            action = resolve_name(f"sim_validate.{ACTIONS[type(command)]}")
            code = action(command, reporter)
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


def _warn(command: flags.Spoken, reporter: "Reporter") -> None:
    """Warn of loops that are compiled again and again, and of results that nobody will see."""
    if type(command) not in (flags.Objects, flags.Doctor) and (faults := why_not_kept()):
        reporter.warn(
            "compiled loops cannot be kept, so that each process compiles them anew, which takes "
            f"up to a minute ({faults}); let the environment variable NUMBA_CACHE_DIR name a "
            "folder that takes files"
        )
    unseen = command.speech.quiet and not command.speech.json
    if isinstance(command, PRODUCING) and unseen and command.out is None:
        reporter.warn(
            "nothing will be written: with -q and without --out only the exit code is left; give "
            "--out DIR, or --json"
        )


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
