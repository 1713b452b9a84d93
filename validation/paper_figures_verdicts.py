"""Whether a claim of the paper holds, by rule: column "holds" of docs/paper-figures.md."""

from __future__ import annotations

from collections.abc import Mapping, Sequence


def verdict_of(held: Mapping[str, bool]) -> str:
    """By what the claim may be about: of all, of some only, of none."""
    if all(held.values()):
        return "yes"
    some = [name for name, one in held.items() if one]
    return f"of {' and '.join(some)} only" if some else "no"


def verdict_share(part: int, whole: int) -> str:
    """By how often it is so: from 90, 75, 50 % on."""
    for least, words in ((0.9, "yes"), (0.75, "mostly"), (0.5, "in part")):
        if part >= least * whole:
            return words
    return "no"


def verdict_exponents(exponents: Sequence[float], whole: float) -> str:
    """Of a fall over k: with exponents of ``whole`` or less in all cases, of less than 0 in all."""
    if max(exponents) <= whole:
        return "yes"
    return "in part" if max(exponents) < 0 else "no"


def verdict_near(value: float, aim: float) -> str:
    """By how far it is from its aim: up to 2, up to 10 %."""
    apart = abs(value / aim - 1)
    return "yes" if apart <= 0.02 else "nearly" if apart <= 0.1 else "no"


def verdict_fall(first: float, last: float, factor: float) -> str:
    """Of a fall by a factor or more; "in kind" where it is less of one."""
    return "yes" if last * factor <= first else "in kind" if last < first else "no"
