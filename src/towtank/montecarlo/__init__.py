"""Monte Carlo: what the uncertainty of derivatives, mass, CG and current does to every trial."""
