"""The game by which forces of a cover are found, as both ways of `cover_search` play it.

A cone is covered if forces have power together on all of its six rays. Weights of the rays, chosen
by what they regret not to have been, meet the force that answers them best; the mean of the
answers, late ones counting more, comes to have power on all rays if any forces do.
"""

ROUNDS = 30
ANSWERS = 3
"""Forces that are tried per contact as the best answer to weights."""
AHEAD = 1e-8
"""Power with which a force counts, relative to its size and the farthest place: more than rounding
sites to a grid may cost it."""
EVEN = 0.02
"""Weight that each ray keeps in the choice of the edge that is cut, so that all are cut in time."""
TINY = 1e-12
"""Share of the friction that forces keep clear of, for rounding."""
