"""Decks of the user's own: cut at two marks, checked, and run with cycle jumps."""

from adapters.decks.adopt import Adoption, adopt
from adapters.decks.check import Difference, check_cut
from adapters.decks.jump import jump
from adapters.decks.scene import adopt_scene, is_deck_scene, load_deck_scene

__all__ = [
    "Adoption", "Difference", "adopt", "adopt_scene", "check_cut", "is_deck_scene", "jump",
    "load_deck_scene",
]  # fmt: skip
