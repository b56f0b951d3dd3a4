"""Several views of one page on a turntable: find the axis, register the views, merge them into one surface."""

from restore.turntable.axis import AxisFit, RotationAxis, fit_axis
from restore.turntable.merge import MergedViews, ViewReport, merge_views

__all__ = ["AxisFit", "MergedViews", "RotationAxis", "ViewReport", "fit_axis", "merge_views"]
