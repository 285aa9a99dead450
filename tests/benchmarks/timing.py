"""Contenders in turns on the same cases, and how many times one is slower than another.

Processor time, so that a busy machine does not count as work; the order turns around from block
to block, so that it slows all of them alike. Ratios are medians over pairs of neighbouring blocks,
with an interval that resampling the blocks leaves 95 times in 100.
"""

import time
from dataclasses import asdict, dataclass, replace

import numpy as np

RESAMPLES = 1000


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    section: str
    what: str
    cases: int
    median_us: float
    """Per case."""
    ratio: float | None = None
    """To the first contender of its group."""
    low: float | None = None
    high: float | None = None
    """Of the ratio, 95 %."""
    remark: str = ""

    def as_json(self):
        return asdict(self)

    def with_remark(self, remark):
        return replace(self, remark=remark)


def in_turns(contenders, blocks):
    """Seconds per case of each contender on each block, (contenders, blocks).

    Args:
        contenders: Name and a function of a block that returns how many cases it dealt with.
        blocks: Sequences of cases.
    """
    seconds = np.zeros((len(contenders), len(blocks)))
    numbered = list(enumerate(contenders.values()))
    for place, block in enumerate(blocks):
        for row, run in numbered if place % 2 else reversed(numbered):
            begun = time.process_time()
            cases = run(block)
            seconds[row, place] = (time.process_time() - begun) / cases
    return seconds


def compared(section, contenders, blocks, remarks=None):
    """A row per contender; all but the first with their ratio to it."""
    for run in contenders.values():
        run(blocks[0])  # what is loaded or compiled on first use does not count
    seconds = in_turns(contenders, blocks)
    return [
        row(section, name, sum(map(len, blocks)), own, seconds[0] if place else None,
            (remarks or {}).get(name, ""))
        for place, (name, own) in enumerate(zip(contenders, seconds, strict=True))
    ]  # fmt: skip


def row(section, what, cases, seconds, reference=None, remark=""):
    """A row from seconds per case on each block, beside those of a reference."""
    median = 1e6 * float(np.median(seconds))
    if reference is None:
        return Row(section, what, cases, median, remark=remark)
    ratios = seconds / np.maximum(reference, 1e-9)
    picks = np.random.default_rng(0).integers(len(ratios), size=(RESAMPLES, len(ratios)))
    low, high = np.quantile(np.median(ratios[picks], axis=1), (0.025, 0.975))
    return Row(section, what, cases, median, float(np.median(ratios)), float(low), float(high),
               remark)  # fmt: skip


def once(section, what, run, cases=1, remark=""):
    """A row from a single run, and what it returned."""
    begun = time.process_time()
    answer = run()
    return row(section, what, cases, np.array([(time.process_time() - begun) / cases]),
               remark=remark), answer  # fmt: skip
