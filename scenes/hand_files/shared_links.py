"""Gives fingers chains of their own where they have their first links in common.

The first finger keeps the links. The others get copies without shapes and masses, whose joints
follow those of the first finger, so that all move as one link.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from grasp_core.hands.couplings import Coupling
from grasp_core.hands.hand import HandFinger, Link


@dataclass(frozen=True, slots=True)
class OwnChains:
    """Fingers with chains of their own."""

    fingers: tuple[HandFinger, ...]
    couplings: tuple[Coupling, ...]
    """Couplings that were given, and those of the copies."""
    originals: dict[str, str]
    """For the name of each copy, the name of the link that it moves with."""

    @property
    def notes(self) -> tuple[str, ...]:
        """Say which links fingers have in common."""
        shared = sorted(set(self.originals.values()))
        return (f"links that fingers have in common: {', '.join(shared)}",) if shared else ()


def own_chains(fingers: Sequence[HandFinger], couplings: tuple[Coupling, ...]) -> OwnChains:
    """Replace links that occur in several fingers by copies in all but the first of them."""
    leaders = {each.joint: each for each in couplings}
    seen, originals, kept = set[str](), dict[str, str](), list[HandFinger]()
    added = list[Coupling]()
    for finger in fingers:
        links = list[Link]()
        for link in finger.links:
            if link.name not in seen:
                links.append(link)
                continue
            name, joint = (f"{each} of {finger.name}" for each in (link.name, link.joint.name))
            own = leaders.get(link.joint.name, Coupling(joint, link.joint.name, 1.0))
            added.append(replace(own, joint=joint))
            originals[name] = link.name
            links.append(
                Link(name, replace(link.joint, name=joint), (), 0.0, np.zeros(3))
            )  # fmt: skip
        seen |= {link.name for link in finger.links}
        kept.append(replace(finger, links=tuple(links)))
    return OwnChains(tuple(kept), (*couplings, *added), originals)
