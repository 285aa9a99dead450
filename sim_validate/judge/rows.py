"""Declares the columns of `judgements.parquet`: the figures and verdicts of each judged record."""

from collections.abc import Iterator, Sequence
from typing import Annotated, Any, Self

from grasp_core.allowed_values import FLAT
from grasp_core.declared import Declared, declared
from grasp_core.figures import Figure
from sim_validate.datasets.parquet import cells_of, columns_of, in_columns, table_bytes
from sim_validate.files.kept_figures import Kept, keeps
from sim_validate.protocols.published import PROTOCOLS
from sim_validate.protocols.verdict import HandTrial, RecordJudgement, TestOfRecord

TABLE = "judgements"
TABLE_FILE = f"{TABLE}.parquet"


def _of_test(protocol: str) -> Iterator[Figure]:
    """Yield `passes_NAME` and `closed_NAME` of a test."""
    for each in in_columns(TestOfRecord, ()):
        yield each._replace(
            name=f"{each.shown.heading}_{protocol.replace('-', '_')}", kind=bool | None,
            meaning=f"{each.meaning} The test is {protocol}; null where it was not asked for.",
        )  # fmt: skip


TESTED = {name: tuple(_of_test(name)) for name in PROTOCOLS}


@keeps(in_columns(RecordJudgement, ()))
class RecordCells(Kept):
    """Figures of a record."""


@keeps(each for own in TESTED.values() for each in own)
class TestCells(Kept):
    """Verdicts of published tests."""

    __test__ = False


@keeps(in_columns(HandTrial, (), "trial_"))
class TrialCells(Kept):
    """Figures of our own trial."""


@declared
class JudgementRow(Declared):
    """A recorded grasp with its figures and verdicts."""

    record: Annotated[RecordCells, FLAT]
    tests: Annotated[TestCells, FLAT]
    trial: Annotated[TrialCells | None, FLAT]

    @classmethod
    def of(cls, record: RecordJudgement) -> Self:
        """Take the figures of a record."""
        tests: dict[str, Any] = dict.fromkeys(TestCells.FIGURES)
        for test in record.tests:
            tests |= {each.name: each.of(test) for each in TESTED[test.protocol]}
        trial = None if record.trial is None else TrialCells.of(record.trial)
        return cls(RecordCells.of(record), TestCells(**tests), trial)


COLUMNS = columns_of(JudgementRow, {})


def rows_of(records: Sequence[RecordJudgement]) -> list[dict[str, Any]]:
    """Return the cells of records, a row each."""
    return [cells_of(JudgementRow.of(each), COLUMNS) for each in records]


def rows_bytes(records: Sequence[RecordJudgement]) -> bytes:
    """Encode records as the bytes of a Parquet file, a row each."""
    return table_bytes(TABLE, rows_of(records), COLUMNS)
