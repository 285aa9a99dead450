"""Refutes one threshold after another, and keeps the best contacts and the best bound so far.

Each threshold is nearer to the best known quality q: the gap is halved from level to level, to
q / (1 - gap) at last. Contacts that are found on the way and reach a threshold become the best
known, and the level is tried again. A level costs more than all before it, as a rule, so that
little is lost by them; and the bound of the last level that was finished holds whenever the search
is stopped.
"""

import math
import time
from collections.abc import Callable

import numpy as np

from grasp_core.errors import InputError
from grasp_core.families.constructions import point_region, regions_of
from grasp_core.families.free import closed_at, of_general_type
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.optimizing.best.grounds import grounds_of
from grasp_core.optimizing.best.incumbents import begin, climbed, piece_at
from grasp_core.optimizing.best.result import BestGrasp, Ended, GapAt, measured
from grasp_core.optimizing.best.same_places import exact_maps, first_nodes
from grasp_core.optimizing.best.searching.parts import Found
from grasp_core.optimizing.best.searching.search import Searching
from grasp_core.optimizing.best.searching.stop import Stop
from grasp_core.optimizing.best.single_twists import lowered_twists, refuted_by_one
from grasp_core.optimizing.best.support_cuts import SEARCHED_BELOW, CutTree, Slack
from grasp_core.planning.certify import Candidate, certify, named, to_grasp
from grasp_core.quality.measures import Measure
from grasp_core.solvers.ties import few_digits, surpassing
from grasp_core.values import ForceCone, Grasp

WIDEST = 0.4
"""Gap of the first level at most: a level is cheap down to it, as the search is for one twist."""
AIMED = 0.999
"""Share of the gap that is aimed at, as the grasp's quality is measured anew in the end."""
FINER = 64.0
"""How much finer than the gap the steps are in which qualities and bounds count."""
SAME = 1e-9
"""Share of a bound that rounding may cost it."""


class Levels:
    """The levels of a search, with the best contacts and the best bound so far."""

    def __init__(
        self, body: Polyhedron, friction: float, measure: Measure, clearance: float, seed: int,
        jobs: int, stop: Stop, progress: Callable[[GapAt], None] | None,
    ) -> None:  # fmt: skip
        self.body, self.friction, self.clearance, self.progress = (
            body, friction, clearance, progress,
        )  # fmt: skip
        self.started = time.perf_counter()
        self.rng = np.random.default_rng([seed])
        self.grounds = grounds_of(body, clearance)
        self.measure = measure
        self.maps = exact_maps(body, self.grounds, measure)
        self.nodes = first_nodes(self.grounds, self.maps)
        self.proved = Slack.of(friction, len(self.maps), measure)
        # searches leave more than proofs, for a replay with other roundings
        self.searched = Slack.of(friction, len(self.maps), measure, SEARCHED_BELOW)
        lowered = self.searched.lowered
        self.searching = Searching(self.grounds, friction, jobs, stop, measure, lowered)
        self.history: list[GapAt] = []
        twists = lowered_twists(self.searching, self.rng)
        cases = len(self.nodes[0])
        self.steps, self.threshold = refuted_by_one(self.searching, cases, self.searched, twists)
        found = begin(self.searching, twists, self.rng)
        if found is None:
            raise InputError(
                f"best_grasp: expected contacts in force closure at friction {friction:g}, found "
                f"none of {body.name}; raise the friction, or lower the clearance"
            )
        self.best = found
        self._tell()

    @property
    def bound(self) -> float:
        """Return what no contacts exceed, by the last threshold that was refuted."""
        return self.threshold + self.proved.raised

    def closed_to(self, gap: float) -> Ended:
        """Refute threshold after threshold, until the gap is reached or the search is stopped."""
        grain = gap / FINER
        steps = max(0, math.ceil(math.log2(WIDEST / gap)))
        try:
            for k in range(steps, -1, -1):
                share = 1.0 - AIMED * gap * 2.0**k
                # each turn lowers the bound to `wanted`, or raises the quality, or is the last
                while self.best.quality.lower < share * (1.0 - SAME) * self.bound:
                    wanted = few_digits(self.best.quality.lower / share, grain)
                    if not self._refuted(wanted, grain):
                        return "time" if self.searching.stop() else "undivided"
        except KeyboardInterrupt:
            return "interrupt"
        return "gap"

    def _refuted(self, bound: float, grain: float) -> bool:
        """Lower the bound, or find contacts better by a grain; return whether either came about."""
        threshold = bound - self.searched.raised
        known = self.best.quality.lower
        surpassed = (1.0 + grain) * known
        steps, better = self.searching.refute(self.nodes, threshold, surpassed)
        if steps is not None:
            self.steps = steps
            self.threshold = bound - self.proved.raised
        for found in better:
            if found.quality.lower > surpassing(self.best.quality.lower):
                self.best = found
        if better:
            self.best = climbed(self.searching, self.best.pieces, self.best.at)
        self._tell()
        return steps is not None or self.best.quality.lower > known

    def _tell(self) -> None:
        seconds = time.perf_counter() - self.started
        now = GapAt(seconds, self.best.quality.lower, self.bound, self.searching.nodes)
        self.history.append(now)
        if self.progress is not None:
            self.progress(now)

    def result(self, ended: Ended) -> BestGrasp:
        """Return the best contacts as a grasp, with the proof."""
        proof = CutTree(
            self.grounds, self.friction, self.maps, self.threshold, self.steps.deeds,
            self.steps.asked, self.steps.twists, self.steps.lines, self.measure,
        )  # fmt: skip
        grasp = self._grasp(self.best)
        quality = measured(self.body, grasp, self.friction, self.measure)
        return BestGrasp(grasp, quality, self.clearance, proof, ended, tuple(self.history))

    def _grasp(self, best: Found) -> Grasp:
        pieces = tuple(piece_at(self.grounds, p) for p in best.pieces)
        points = np.array([piece.point(y) for piece, y in zip(pieces, best.at, strict=True)])
        plain = closed_at(pieces, points, self.friction, 0.0)
        placement = plain and of_general_type(pieces, plain, self.friction, self.rng)
        if placement is not None:
            a, b, c, d = (piece.face for piece in pieces)
            faces = (a, b, c, d)
            cones = tuple(ForceCone(piece.normal, math.atan(self.friction)) for piece in pieces)
            regions = regions_of(point_region, pieces, cones, placement)
            candidate = Candidate(
                named("b", faces), faces, "regulus", pieces, cones, placement, regions
            )
            found = certify(candidate, self.friction)
            if found is not None:
                return to_grasp(self.body, self.friction, found)
        raise InputError(
            f"best_grasp: expected that the best contacts found, on faces "
            f"{[piece.face for piece in pieces]}, can be certified, and they cannot; try another "
            "seed"
        )
