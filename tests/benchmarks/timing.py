"""Processor time of runs, so that a busy machine does not count as work."""

import time
from dataclasses import asdict, dataclass, replace

import numpy as np


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    section: str
    what: str
    cases: int
    median_us: float
    """Per case."""
    remark: str = ""

    def as_json(self):
        return asdict(self)

    def with_remark(self, remark):
        return replace(self, remark=remark)


def in_turns(contenders, blocks):
    """Seconds per case of each contender on each block, (contenders, blocks).

    The order turns around from block to block, so that what slows the machine slows all alike.

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


def row(section, what, cases, seconds, remark=""):
    """A row from seconds per case on each block."""
    return Row(section, what, cases, 1e6 * float(np.median(seconds)), remark)


def once(section, what, run):
    """A row from a single run, and what it returned."""
    begun = time.process_time()
    answer = run()
    return row(section, what, 1, time.process_time() - begun), answer
