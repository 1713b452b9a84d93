"""Several seeds and values of a scene's keys, side by side."""
