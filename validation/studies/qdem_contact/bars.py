"""Every figure of the record, held anew against the bar that stands beside it."""

from functools import partial

from validation.bench.qdem.checks import list_checks

check_bars = partial(list_checks, page="docs/qdem-contact.md")
