"""One case a file; each has ``run(quick) -> list[Check]``."""
