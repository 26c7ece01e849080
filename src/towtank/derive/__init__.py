"""Stage 5: from captive runs to derivatives."""
