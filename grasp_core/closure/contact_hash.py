"""A hash of contacts, to tell whether they are still the same."""

import hashlib
from collections.abc import Iterable

import numpy as np

from grasp_core.closure.contact_arrays import stacked
from grasp_core.values import Contact


def contacts_sha256(contacts: Iterable[Contact]) -> str:
    """Of positions and normals in finger order; 0.0 and -0.0 are the same."""
    numbers = np.concatenate([part.ravel() for part in stacked(contacts)]) + 0.0
    return hashlib.sha256(numbers.astype("<f8").tobytes()).hexdigest()
