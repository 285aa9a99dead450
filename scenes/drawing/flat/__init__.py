"""How is a flat drawing described, laid out as a chart, and written as SVG text?

A drawing is a sheet of marks in pixels: areas, lines, dots, words and small images. Pages and
notebooks take the sheet as SVG; `scenes/drawing/canvas.py` draws the same sheet with matplotlib for
other formats.
"""
