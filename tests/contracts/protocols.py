"""What a member lacks of what its kind asks for."""

from __future__ import annotations

import inspect
from typing import Any


def list_missing(member: Any, protocol: type) -> list[str]:
    """Attributes and methods of a protocol that a member has not, or has with other arguments."""
    missing = []
    asked = {**protocol.__annotations__, **vars(protocol)}
    for name in sorted(name for name in asked if not name.startswith("_")):
        method = getattr(protocol, name, None)
        if not hasattr(member, name):
            missing.append(name)
        elif inspect.isfunction(method):
            arguments = list(inspect.signature(method).parameters)[1:]
            if (
                list(inspect.signature(getattr(member, name)).parameters)[: len(arguments)]
                != arguments
            ):
                missing.append(f"{name}({', '.join(arguments)})")
    return missing
