"""What a tank is."""

from __future__ import annotations

from typing import Any, Protocol

from towtank.craft.craft import Craft
from towtank.plan.kinds import CaptiveTest
from towtank.progress import Progress
from towtank.tank.run import Run


class Tank(Protocol):
    """Anything that can run a captive test: the fast tank, a CFD code, a known coefficient set."""

    @property
    def level(self) -> str:
        """Level of evidence: semi-empirical, rans, experiment, published, known coefficients."""

    def settings(self) -> dict[str, Any]:
        """What, beside craft and test, decides the result; goes into the run's identity and provenance."""

    def run(self, craft: Craft, test: CaptiveTest, progress: Progress) -> Run:
        """Run one test. Raises ``TankError`` with the remedy when it cannot be done."""
