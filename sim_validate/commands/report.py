"""Runs the command `report`, which writes the results of a run as pages for a browser."""

from pathlib import Path

from sim_validate.cli import showing_flags
from sim_validate.cli.console import Reporter
from sim_validate.cli.exit_codes import Exit
from sim_validate.files.folder_lock import alone_in
from sim_validate.reports.report import Report, write_report
from sim_validate.reports.run_folder import folder_of


def report_folder(command: showing_flags.Report, reporter: Reporter) -> int:
    """Write the results of a run as pages, and print where they are."""
    at = command.out or folder_of(command.folder)
    with alone_in(at if command.out or at.is_dir() else None):
        report = shown_report(command, reporter)
    reporter.document({"report": str(report.index), "grasps": report.grasps})
    return Exit.GOOD


def shown_report(asked: showing_flags.Report, reporter: Reporter) -> Report:
    """Write the pages of a run, and say where they are."""

    def say_ready(index: Path, drawn: int, total: int) -> None:
        reporter.say(
            f"report: {index} can be opened now; {drawn} of {total} cards are drawn, "
            "the others follow"
        )

    with reporter.progress("drawing") as steps:
        report = write_report(
            asked.folder,
            asked.out,
            jobs=asked.jobs,
            limit=asked.limit,
            clips=asked.clips,
            every_copy=asked.every_copy,
            progress=steps.update,
            ready=say_ready,
        )
    if report.no_clip:
        reporter.warn(f"no clips: {report.no_clip}")
    reporter.say(f"report: open {report.index} in a browser")
    return report
