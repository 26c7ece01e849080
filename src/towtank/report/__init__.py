"""The report: one self-contained page. Calling the package writes it: ``towtank.report("hokie.html", ...)``."""

from towtank.stage import make_callable

ENTRY = "towtank.report.build:report"
make_callable(__name__)
