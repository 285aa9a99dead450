"""Simulates the grasps of a baseline again, and compares each with its recorded result."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from sim_validate.baselines.compare import Carried, Finding, Status, bands_between, compare
from sim_validate.baselines.entries import Baseline
from sim_validate.baselines.measure import Measured, Report, measured, with_planned_fingers
from sim_validate.baselines.parts.changed_part import Present
from sim_validate.baselines.settings import How
from sim_validate.validation.verdict import Verdict


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
    before: Baseline, now: Present, where: str, how: How, processors: int, report: Report
) -> Checked:
    """Simulate grasps again and compare them with a baseline.

    Takes `report` (done, total).
    """
    now = now.first(before.limit)
    how = with_planned_fingers(how, before, now.saved)
    if now.gone and not now.saved.grasps:
        found = _nothing_measured(before, now)
    else:
        found = measured(now.saved, (where, before.limit), how, processors, report)
    carried = _carried(now)
    return Checked(
        compare(before, found.baseline, found.refused, carried),
        found,
        bands_between(before, found.baseline, carried)[1],
    )


def check_one(before: Baseline, now: Present, where: str, how: How, name: str) -> Checked:
    """Simulate one grasp again, by its id, and compare it with a baseline."""
    one = now.first(before.limit).only(name)
    kept = replace(before, entries=tuple(e for e in before.entries if e.id == name), limit=None)
    if one.saved.grasps or one.gone:
        return check(kept, one, where, how, 1, silent)
    gone = _nothing_measured(kept, one)
    return Checked(compare(kept, gone.baseline, carried=_carried(one)), gone, "")


def _carried(now: Present) -> Carried | None:
    """Say what a comparison must know of a part that is not the planned or the recorded one."""
    known = now.carried is not None or now.since is not None or bool(now.change)
    return Carried(now.change, now.gone) if known else None


def _nothing_measured(before: Baseline, now: Present) -> Measured:
    """Return a measurement of no grasp, on the part as it is now."""
    body = now.saved.body
    return Measured(replace(before, entries=(), content_sha256=body.content_sha256), {}, {})


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
