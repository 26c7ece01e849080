"""Stage 1: what is tested."""
