"""Shared cases such as ``synthetic_craft`` are imported from this folder, which pytest puts on the path."""
