"""Every figure of the record, held anew against the bar that stands beside it."""

from functools import partial

from validation.bench.qdem.checks import checks_of

check_bars = partial(checks_of, page="docs/qdem-validation.md")
