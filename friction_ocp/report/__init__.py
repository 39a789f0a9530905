"""The HTML page of a result, which only reads results."""

from friction_ocp.report.page import write_report
from friction_ocp.report.sentence import verdict_sentence

__all__ = ["verdict_sentence", "write_report"]
