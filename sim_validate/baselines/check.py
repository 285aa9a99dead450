"""Simulates the grasps of a baseline again, and compares each with its recorded result."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from grasp_core.records.grasps_json import SavedGrasps
from sim_validate.baselines.compare import Finding, Status, bands_between, compare
from sim_validate.baselines.entries import Baseline
from sim_validate.baselines.measure import Measured, Report, measured, with_planned_fingers
from sim_validate.baselines.settings import How
from sim_validate.validation.grasp_verdict import Verdict


@dataclass(frozen=True, slots=True, eq=False)
class Checked:
    """The result of a check: how the grasps of a baseline have changed."""

    findings: tuple[Finding, ...]
    measured: Measured
    how: str
    """How strictly results were compared, in words."""

    @property
    def verdicts(self) -> Mapping[str, Verdict]:
        """Verdicts on the grasps that could be simulated, by id."""
        return self.measured.verdicts


def check(
    before: Baseline, saved: SavedGrasps, where: str, how: How, processors: int, report: Report
) -> Checked:
    """Simulate grasps again and compare them with a baseline.

    Args:
        before: The baseline.
        saved: The present grasps.
        where: Path of the grasps from the baseline's folder.
        how: How trials are simulated, and which ones.
        processors: Number of processors to use; no result depends on it.
        report: Called with (done, total) after each grasp.

    Raises:
        InputError: The file of grasps is empty.
        UnfaithfulError: The simulator fails its checks on cases with known answers.
    """
    how = with_planned_fingers(how, before, saved)
    found = measured(saved, (where, before.limit), how, processors, report)
    return Checked(
        compare(before, found.baseline, found.refused),
        found,
        bands_between(before, found.baseline)[1],
    )


def check_one(before: Baseline, saved: SavedGrasps, where: str, how: How, name: str) -> Checked:
    """Simulate one grasp again, by its id, and compare it with a baseline."""
    limited = saved.grasps[: before.limit]
    one = tuple(grasp for grasp in limited if grasp.id == name)
    kept = replace(before, entries=tuple(e for e in before.entries if e.id == name), limit=None)
    if one:
        alone = SavedGrasps(saved.body, saved.friction, saved.seed, one, saved.finger)
        return check(kept, alone, where, how, 1, silent)
    gone = Measured(replace(kept, entries=(), content_sha256=saved.body.content_sha256), {}, {})
    return Checked(compare(kept, gone.baseline), gone, "")


def demanded(done: Checked) -> Checked:
    """Count grasps that do not survive their execution as regressed, whatever the baseline says.

    A grasp that has no entry now, or whose settings differ from the baseline's, stays as it is.
    """
    return replace(done, findings=tuple(map(_surviving, done.findings)))


def _surviving(finding: Finding) -> Finding:
    now = None if finding.after is None else finding.after.execution
    if now is None or now.survived or finding.status is Status.NOT_COMPARABLE:
        return finding
    why = "the grasp must survive its execution, but does not"
    return replace(finding, status=Status.REGRESSED, reasons=(why, *finding.reasons))


def silent(_: int, __: int) -> None:
    """Ignore a report of progress."""
