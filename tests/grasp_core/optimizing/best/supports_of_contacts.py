"""What contacts on pieces of faces answer to twists, by the definition alone."""

import numpy as np


def supports(found, on, at, twists):
    """The support of each contact in each twist by the definition, (count, 4, n)."""
    grounds = found.proof.grounds
    x = grounds.origins[on] + np.einsum("...ij,...j->...i", grounds.frames[on], at)
    u = twists[:, :3] + np.cross(twists[:, 3:], x[..., None, :])
    along = np.einsum("...nj,...j->...n", u, grounds.normals[on])
    across = np.sqrt(np.maximum((u * u).sum(axis=-1) - along**2, 0.0))
    return along + found.proof.friction * across
