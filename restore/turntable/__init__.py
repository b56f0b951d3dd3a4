"""Several views of one page on a turntable.

Finds the axis, registers the views, merges them into one surface.
"""

from restore.turntable.axis import AxisFit, RotationAxis, fit_axis
from restore.turntable.merge import MergedViews, ViewReport, merge_views

__all__ = ["AxisFit", "MergedViews", "RotationAxis", "ViewReport", "fit_axis", "merge_views"]
