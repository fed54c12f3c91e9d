"""Reports: pages for a browser that show plans, swarms and studies in 3-D; videos and moving scenes for other programs."""

from spacearm.report.report_plan import report_of_plans, save_report

__all__ = ["report_of_plans", "save_report"]
