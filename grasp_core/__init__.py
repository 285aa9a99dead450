"""Plans four-finger force-closure grasps of polyhedra, and proves force closure or its absence.

Each name is imported when it is first used; the stub file beside this one lists its module.
"""

from grasp_core.lazy_names import names_in_stub

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = names_in_stub(__name__, __file__)
