"""Pilots judged and improved on the craft they fly: robust margins, gains from trials, predictive control."""
