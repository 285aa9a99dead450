"""Which function carries out which command."""

from pkgutil import resolve_name
from typing import Any

from sim_validate import baseline_flags, cli, dataset_flags, showing_flags
from sim_validate.console import Reporter

ACTIONS: dict[type[Any], str] = {
    cli.Run: "run_command:run_object",
    cli.Plan: "plan_command:plan_file",
    cli.Validate: "validate_command:validate_file",
    cli.Scene: "scene_command:write_scenes",
    showing_flags.View: "view_command:view_grasp",
    showing_flags.Report: "report_command:report_folder",
    cli.Regions: "regions_command:certify_file",
    cli.Replay: "replay_command:replay_trial",
    cli.Analyze: "analyze_command:analyze_file",
    dataset_flags.Build: "dataset_commands:build_dataset",
    dataset_flags.Import: "dataset_commands:import_dataset",
    dataset_flags.Verify: "dataset_commands:verify_dataset",
    dataset_flags.Export: "dataset_commands:export_dataset",
    baseline_flags.Record: "baseline_commands:record_baseline",
    baseline_flags.Check: "baseline_commands:check_baseline",
    cli.Inspect: "object_commands:inspect_object",
    cli.Objects: "object_commands:list_objects",
    cli.Doctor: "doctor_command:check_installation",
}
"""By name, as planning must not wait for a simulator to be imported."""


def execute(command: cli.Command) -> int:
    """Carry out a command and return its exit code."""
    speech = command.speech
    reporter = Reporter(speech.quiet, speech.verbose, speech.json)
    asked = command.action if isinstance(command, cli.Dataset | cli.Baseline) else command
    return resolve_name(f"sim_validate.{ACTIONS[type(asked)]}")(asked, reporter)
