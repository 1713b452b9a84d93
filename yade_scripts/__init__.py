"""Static scripts of the YADE engine; ``adapters.engine_yade`` writes the JSON file they read."""
