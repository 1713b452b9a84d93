"""The page of a run's report, and the style of its figures."""
