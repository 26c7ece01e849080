"""One function per figure; each takes a noun and returns Axes."""
