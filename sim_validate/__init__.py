"""Simulate grasps, judge them, and compare them with what the analysis predicts.

Names are imported on first use; the stub beside this file says where from.
"""

from grasp_core.lazy_names import names_in_stub

__getattr__, __dir__, __all__ = names_in_stub(__name__, __file__)
