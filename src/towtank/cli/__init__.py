"""The command line: one file per command, no physics. Heavy imports happen inside the commands."""

from __future__ import annotations


def main() -> None:
    """Entry point of ``towtank``. Exit codes: 0 done, 2 bad input, 3 a stage failed, 130 stopped by Ctrl-C."""
    try:
        from towtank.cli.app import app

        app()
    except KeyboardInterrupt:
        raise SystemExit(130) from None
