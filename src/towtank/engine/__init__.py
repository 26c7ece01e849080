"""The engine: the closed loop as one text, compiled, vectorised and differentiated."""
