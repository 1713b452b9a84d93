"""What a member lacks of what its kind asks for."""

from __future__ import annotations

import inspect
from typing import Any


def list_missing(member: Any, protocol: type) -> list[str]:
    """Attributes and methods of a protocol that a member has not, or has with other arguments."""
    missing = []
    asked = {**protocol.__annotations__, **vars(protocol)}
    for name in sorted(name for name in asked if not name.startswith("_")):
        method, own = getattr(protocol, name, None), getattr(member, name, None)
        if not inspect.isfunction(method):
            missing += [] if hasattr(member, name) else [name]
            continue
        arguments = list(inspect.signature(method).parameters)[1:]
        if own is None or list(inspect.signature(own).parameters)[: len(arguments)] != arguments:
            missing.append(f"{name}({', '.join(arguments)})")
    return missing
