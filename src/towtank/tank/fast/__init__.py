"""The built-in fast tank: panels, boundary layer, cross-flow, fins. Level semi-empirical."""
