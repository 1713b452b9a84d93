"""Every figure of the record against its bar."""

from functools import partial

from validation.bench.qdem.checks import list_checks

check_bars = partial(list_checks, page="docs/qdem-elements.md")
