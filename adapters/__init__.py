"""Settlement of granular beds under cyclic load, computed by an engine as it is installed."""
