"""The house keeps its rules, and every rule can be broken."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.house import rules
from tests.house.rules import PRODUCT, RULES, House, weigh

ROOT = Path(__file__).parents[2]


def test_house_keeps_its_rules() -> None:
    """No rule is broken; where one is, each place is named with file, line and rule."""
    house = House(ROOT)
    breaches = [str(one) for rule in RULES for one in rule(house)]
    assert not breaches, "\n".join(["", *breaches])


def test_house_is_within_its_weight() -> None:
    """Each part weighs at most what ``budget.toml`` allows, or what it weighed when that was set.

    What is still above its budget may only become lighter: its line of ``[above]`` follows.
    """
    house = House(ROOT)
    above = house.budget["above"]
    for part, (found, allowed) in weigh(house).items():
        limit = above.get(part, allowed)
        assert found <= limit, f"{part}: {found:,} of {limit:,} (budget {allowed:,})"
        assert part not in above or allowed < limit <= 1.02 * found, f"lower {part} in [above]"


def build_house(root: Path, files: dict[str, str]) -> House:
    """A small house of three rooms that keeps every rule, with ``files`` put in."""
    sound = {f"{package}/__init__.py": '"""A package."""\n' for package in PRODUCT}
    sound |= {f"{package}/{name}.py": "" for package in PRODUCT for name in ("one", "two")}
    sound |= {
        "adapters/bed/__init__.py": '"""The bed."""\nfrom adapters.bed.state import State\n'
        '__all__ = ["State"]\n',
        "adapters/bed/state.py": "class State: ...\n",
        "adapters/bed/radii.py": "from adapters.bed.state import State\n",
        "adapters/jumps/__init__.py": '"""Jumps."""\n',
        "adapters/jumps/slopes.py": "from adapters.bed import State\n",
        "adapters/jumps/band.py": "from trackbed import one\n",
        "README.md": "",
        "tests/house/budget.toml": (ROOT / "tests" / "house" / "budget.toml").read_text(),
    }
    for file, text in (sound | files).items():
        path = root / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return House(root)


def test_a_sound_house_has_no_breach(tmp_path: Path) -> None:
    """The small house of these tests keeps every rule, so that what breaks is what was put in."""
    house = build_house(tmp_path, {})
    assert [str(one) for rule in RULES for one in rule(house)] == []


@pytest.mark.parametrize(
    ("rule", "file", "text", "place"),
    [
        ("rooms", "adapters/bed/long.py", "x = 1\n" * 401, "long.py:401: rule 1"),
        ("rooms", "adapters/bed/bed_state.py", "", "bed_state.py:1: rule 1"),
        ("rooms", "adapters/moves/move.py", "", "move.py:1: rule 1"),
        ("rooms", "adapters/utils/one.py", "", "one.py:1: rule 1: named after nothing"),
        ("rooms", "adapters/alone/one.py", "", "adapters/alone:1: rule 1: 1 files"),
        (
            "circles", "adapters/bed/state.py",
            "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n"
            "    from adapters.bed.radii import r\n",
            "adapters/bed/radii.py:1: rule 2: files import in a circle",
        ),
        (
            "circles", "adapters/bed/radii.py",
            "def f():\n    from adapters.jumps import slopes\n",
            "adapters/bed/radii.py:2: rule 2: rooms in a circle",
        ),
        (
            "public_words", "adapters/jumps/slopes.py",
            "from adapters.bed.radii import sieve\n", "slopes.py:1: rule 3",
        ),
        (
            "public_words", "adapters/jumps/slopes.py",
            "from adapters.bed import sieve\n", "slopes.py:1: rule 3: sieve is no public word",
        ),
        ("public_words", "adapters/bed/__init__.py", "", "does not say what the room is for"),
        ("floor", "trackbed/one.py", "import adapters.bed\n", "one.py:1: rule 4"),
        ("floor", "qdem_fem/one.py", "def f():\n    import rigid_lcp\n", "one.py:2: rule 4"),
        ("floor", "qdem_fem/one.py", "import validation.study\n", "one.py:1: rule 4"),
        (
            "studies", "tests/unit/test_one.py",
            "from validation.studies.laws import run\n", "test_one.py:1: rule 5",
        ),
        (
            "studies", "tests/unit/test_one.py",
            "\nrows = open('validation/studies/laws/record.jsonl')\n", "test_one.py:2: rule 5",
        ),
        ("constants", "adapters/bed/radii.py", "SMALL = 1e-9\n", ""),
        ("verbs", "adapters/bed/radii.py", "def radii_of(): ...\n", "radii.py:1: verbs"),
        ("references", "adapters/bed/radii.py", '"""As `sift`."""\n', "radii.py:1: references"),
        ("words", "adapters/bed/radii.py", '"""What is made anew."""\n', "radii.py:1: plain"),
        ("readme", "README.md", "Two words.\n" * 251, "README.md:1: readme: 502 words of 500"),
        ("readme", "README.md", "```\n" + "code " * 501 + "\n```\n" + "word " * 25, ""),
        ("readme", "README.md", "word " * 26, "README.md:1: readme: a long sentence"),
    ],
)  # fmt: skip
def test_a_breach_is_named(tmp_path: Path, rule: str, file: str, text: str, place: str) -> None:
    """Each rule names file, line and rule of what breaks it."""
    said = "\n".join(map(str, getattr(rules, f"check_{rule}")(build_house(tmp_path, {file: text}))))
    assert place in said
    assert bool(said) == bool(place)


def test_a_constant_has_one_home(tmp_path: Path) -> None:
    """The same name for a number in two files of a package is a breach in the second."""
    files = {
        "adapters/bed/radii.py": "SMALL = 1e-9\n",
        "adapters/jumps/band.py": "\nSMALL = 2e-9\n",
        "qdem_fem/one.py": "SMALL = 3e-9\n",
    }
    (breach,) = rules.check_constants(build_house(tmp_path, files))
    assert str(breach).startswith("adapters/jumps/band.py:2: rule 6: SMALL")


def test_weight_counts_what_is_there(tmp_path: Path) -> None:
    """Lines of Python, bytes of records and words of pages."""
    empty = {"README.md": "", "CHANGELOG.md": "", "CONTRIBUTING.md": ""}
    files = empty | {
        "adapters/bed/state.py": "x = 1\n" * 7,
        "validation/studies/laws/record.jsonl": "{}\n",
        "docs/laws.md": "three words here\n",
    }
    before = weigh(build_house(tmp_path, empty))
    after = weigh(build_house(tmp_path, files))
    gained = {part: after[part][0] - before[part][0] for part in after}
    assert gained["lines of the product"] == 6
    assert gained["bytes of records"] == 3
    assert gained["words of prose"] == 3
