"""One tiny run an engine, shared with ``tests/engines``."""

from tests.engines.conftest import sample, samples

__all__ = ["sample", "samples"]
