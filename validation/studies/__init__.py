"""Studies: a folder each, which reads like an experiment: question, run, bars, page."""
