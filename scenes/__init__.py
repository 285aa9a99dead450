"""Turn grasps into MuJoCo scenes, and make the built-in example objects.

Each name is imported when it is first used; the stub file beside this one lists its module. With
this package, objects, grasps and plans show pictures in notebooks.
"""

from typing import Any

from grasp_core.lazy_names import names_in_stub
from grasp_core.notebooks import draw_with

__getattr__, __dir__, __all__ = names_in_stub(__name__, __file__)


def _html_of(value: Any) -> str | None:
    from scenes.drawing.pages import html_of

    return html_of(value)


draw_with(_html_of)
