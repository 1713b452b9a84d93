"""One tiny run an engine, shared with ``tests/engines``."""

from tests.engines.conftest import sample

__all__ = ["sample"]
