"""The command that writes a report of a run."""

from pathlib import Path

from sim_validate import cli
from sim_validate.console import Reporter
from sim_validate.reports.report import Report, write_report


def report_folder(command: cli.Report, reporter: Reporter) -> int:
    """Write the pages of a run."""
    report = shown_report(command.folder, command.out, command.jobs, command.clips, reporter)
    reporter.document({"report": str(report.index), "grasps": report.grasps})
    return cli.Exit.GOOD


def shown_report(
    folder: Path, out: Path | None, jobs: int, clips: int, reporter: Reporter
) -> Report:
    """Write a report, and say where it is."""
    with reporter.progress("drawing") as steps:
        report = write_report(folder, out, jobs=jobs, clips=clips, progress=steps.update)
    if report.no_clip:
        reporter.warn(f"no clips: {report.no_clip}")
    reporter.say(f"report: open {report.index} in a browser")
    return report
