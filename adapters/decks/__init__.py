"""Decks of the user's own: cut at two marks, checked, and run with cycle jumps."""

from adapters.decks.adopt import Adoption, adopt
from adapters.decks.check import check_cut, keep_check
from adapters.decks.jump import jump
from adapters.decks.record import read_deck_record
from adapters.decks.run import resume_deck, run_deck_scene
from adapters.decks.scene import is_deck_scene, load_deck_scene

__all__ = [
    "Adoption", "adopt", "check_cut", "is_deck_scene", "jump", "keep_check",
    "load_deck_scene", "read_deck_record", "resume_deck", "run_deck_scene",
]  # fmt: skip
