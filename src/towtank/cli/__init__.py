"""The command line: one file per command, no physics. Heavy imports happen inside the commands."""

from __future__ import annotations

import os


def main() -> None:
    """Entry point of ``towtank``. Exit codes: 0 done, 2 bad input, 3 a stage failed, 130 stopped by Ctrl-C."""
    # The matrices are small: threads of the linear algebra only get in each other's way.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        from towtank.cli.app import app

        app()
    except KeyboardInterrupt:
        raise SystemExit(130) from None
