"""Runs the `graspproof` command: turns arguments into flags, runs a command, returns an exit code.

This module imports nothing that is slow to load, so that help and usage errors answer at once.
"""

import gc
import os
import sys
import traceback
from collections.abc import Sequence
from dataclasses import make_dataclass
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, NoReturn, Union, cast

import tyro
from tyro.conf import FlagCreatePairsOff

from grasp_core.errors import GraspError, InputError
from grasp_core.messages import FieldError, near, shown
from grasp_core.time_spent import TIME_SPENT, in_words
from sim_validate.commands.exit_codes import (
    Exit,
    FlagsError,
    end_streams,
    exit_code,
    reason_of,
    steady_streams,
)
from sim_validate.commands.table import COMMANDS, GROUPS, examples_for
from sim_validate.processes.interrupts import interrupts_noted

if TYPE_CHECKING:
    from sim_validate.commands.console import Reporter
    from sim_validate.commands.flags import Spoken

ABOUT = (
    "Four-finger force-closure grasps, proved and simulated. Every command also takes "
    "--config FILE.toml, whose keys are flags; flags given override it. `graspproof "
    "--version` prints versions."
)
PRODUCING = ("plan", "regions", "transfer", "reach")
"""Commands of whose results the exit code says little."""

COLLECTED_AFTER = 400_000
"""Number of new objects after which Python looks for unused circles of objects among them. It is
700 otherwise; a tenth of the time of a plan would go into looking among what packages make when
they are imported, 150,000 objects, and in vain: commands leave next to no circles."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the `graspproof` command with some arguments.

    Gives an exit code; see `Exit`.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    try:
        if arguments == ["--version"]:
            print(_version())  # noqa: T201 - the result itself; a closed stream takes nothing
            return Exit.GOOD
        name, command = _parsed(arguments)
    except SystemExit as stop:
        sys.stdout.write(examples_for(arguments))
        return stop.code if isinstance(stop.code, int) else Exit.USAGE
    except InputError as error:
        return _complain(str(error), exit_code(error))
    except KeyboardInterrupt:
        return _complain("interrupted", Exit.INTERRUPTED)
    return _dispatch(name, command)


def _parsed(arguments: list[str]) -> tuple[str, "Spoken"]:
    """Return the name of a command and its flags.

    The parser exits where help is asked for, or a flag is unknown.
    """
    try:
        Path.cwd()
    except OSError as error:  # nor could loops be compiled there
        raise InputError("the working folder is gone; change to one that exists") from error
    if "" in arguments:
        said = "an argument is empty, perhaps from a variable that is not set"
        raise FlagsError(f"{said}; leave the argument out, or give it a value")
    path, words = _config_of(arguments)
    name = _command_of(words)
    if name not in COMMANDS:
        _list_commands(name, words)
    # what a command needs is loaded only for that command
    from sim_validate.commands.config_file import with_config
    from sim_validate.commands.flag_values import REGISTRY, flags_of

    kind: Any = resolve_name(f"sim_validate.{COMMANDS[name].flags}")
    words = with_config(words[len(name.split()) :], path, kind)
    try:
        return name, tyro.cli(
            FlagCreatePairsOff[kind],
            prog=f"graspproof {name}",
            description=COMMANDS[name].help,
            args=words,
            registry=REGISTRY,
        )
    except FieldError as error:
        field = error.name.partition("[")[0]
        names = (each.name for each in flags_of(kind)
                 if (each.owner, each.field) == (error.owner, field))  # fmt: skip
        flag = "--" + next(names, field).replace("_", "-")
        raise FlagsError(f"{flag} {error.fault}") from error
    except InputError as error:  # settings that do not fit each other
        raise FlagsError(str(error)) from error


def _config_of(arguments: list[str]) -> tuple[Path | None, list[str]]:
    words = [
        part
        for word in arguments
        for part in (word.split("=", 1) if word.startswith("--config=") else [word])
    ]
    if "--config" not in words:
        return None, arguments
    at = words.index("--config")
    if at + 1 >= len(words):
        raise FlagsError("--config needs the path of a TOML file after it")
    return Path(words[at + 1]), words[:at] + words[at + 2 :]


def _command_of(words: Sequence[str]) -> str:
    """Return the command or the group that words begin with; an empty text where they name none."""
    name = ""
    while name not in COMMANDS:
        start = f"{name} ".lstrip()
        names = dict.fromkeys(
            each.removeprefix(start).split()[0] for each in COMMANDS if each.startswith(start)
        )
        place = len(name.split())
        if place == len(words) or words[place].startswith("-"):
            break
        if words[place] not in names:
            hint = near(words[place], names) or f"the commands are {', '.join(names)}"
            raise FlagsError(f"there is no command {shown(start + words[place])}; {hint}")
        name = start + words[place]
    return name


def _list_commands(group: str, words: Sequence[str]) -> NoReturn:
    helps = {name: each.help for name, each in COMMANDS.items() if name.startswith(group)}
    if not group:
        helps = {name.split()[0]: GROUPS.get(name.split()[0], said) for name, said in helps.items()}
    kinds: list[Any] = []
    for name, said in helps.items():
        kinds.append(make_dataclass(name.split()[-1].title(), []))
        kinds[-1].__doc__ = said
    about, prog = GROUPS.get(group, ABOUT), f"graspproof {group}".strip()
    listed = cast("Any", Union)[tuple(kinds)]
    tyro.cli(listed, prog=prog, description=about, args=words[len(group.split()) :])
    raise AssertionError(words)  # no command is complete without its own flags


def _version() -> str:
    from grasp_core.provenance import versions

    found = versions()
    return ", ".join(f"{name} {found[name.lower()]}" for name in ("graspproof", "MuJoCo", "Python"))


def _dispatch(name: str, command: "Spoken") -> int:
    speech = command.speech
    try:
        with interrupts_noted():
            from sim_validate.commands.console import Reporter

            reporter = Reporter(speech.quiet, speech.verbose, speech.json)
            _warn(name, command, reporter)
            action = resolve_name(f"sim_validate.{COMMANDS[name].action}")
            code = action(command, reporter)
            reporter.detail(in_words(TIME_SPENT.taken()))
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


def _warn(name: str, command: Any, reporter: "Reporter") -> None:
    from grasp_core.compiled import why_not_kept

    if name not in ("objects", "doctor") and (faults := why_not_kept()):
        reporter.warn(
            "compiled loops cannot be kept, so that each process compiles them anew, which takes "
            f"up to a minute ({faults}); let the environment variable NUMBA_CACHE_DIR name a "
            "folder that takes files"
        )
    unseen = command.speech.quiet and not command.speech.json
    if name in PRODUCING and unseen and command.out is None:
        reporter.warn(
            "nothing will be written: with -q and without --out only the exit code is left; give "
            "--out DIR, or --json"
        )


def _complain(message: str, code: Exit) -> int:
    from sim_validate.commands.console import printable

    if sys.stderr is not None:  # pyright: ignore[reportUnnecessaryComparison] - may be closed
        sys.stderr.write(f"graspproof: {printable(message)}\n")
    return int(code)


def run_and_exit() -> None:
    """Run the `graspproof` command as a program, and exit with its exit code."""
    gc.set_threshold(COLLECTED_AFTER)
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "1")  # it would look through all packages
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # for small matrices others wait, and busily
    steady_streams()
    code = main()
    end_streams()
    gc.freeze()  # ending, Python would look through all objects for circles
    sys.exit(code)
