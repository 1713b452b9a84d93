"""Static scripts of the YADE engine; ``adapters.engines.yade`` writes the JSON file they read."""
