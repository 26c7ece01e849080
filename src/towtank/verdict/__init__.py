"""Stage 8: is the craft stable, and what does it cost to hold it."""
