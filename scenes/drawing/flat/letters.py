"""Estimates from above how wide a text is, in fonts that readers may have."""

NARROW, WIDE = set("ijl.,:;|'!fItr()[] -"), set("mwMW@%+=<>≤")
SMALL, USUAL, LARGE = 0.42, 0.66, 1.0
"""Widths of letters in DejaVu Sans, the widest of common fonts, in letter sizes."""


def width_of(text: str, size: float) -> float:
    """Return a width that the text does not exceed [pixels]."""
    return size * sum(
        SMALL if letter in NARROW else LARGE if letter in WIDE else USUAL for letter in text
    )
