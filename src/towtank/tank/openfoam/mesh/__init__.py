"""Structured meshes around hull and fins, and what is measured on them."""
