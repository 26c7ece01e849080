"""Logs of craft at sea, of whatever origin, read to ``SeaLog``: units, clocks, axes and sensor places at the gate."""

from towtank.field.reading.gate import read_sea_log as read_sea_log
