"""Pages for readers: links lead somewhere, and words are spelt as elsewhere, without a network."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGES = [*ROOT.glob("*.md"), *ROOT.glob("docs/*.md")]
MADE = {"gallery.md", "keys.md", "verbs.md"}  # from the code, on the site alone
CODE = re.compile(r"```.*?```|`[^`\n]*`|\]\([^)]*\)", re.DOTALL)
OFTEN = 8  # uses from which on a word is taken as spelt right
RIGHT = {"bonded", "breach", "clause", "losing"}  # slips of no word, though they look like it


def find_lost_links(page: Path, text: str) -> list[str]:
    """Links of a page to files that are not there, and to headings that their page has not."""
    lost = []
    for link in re.findall(r"\]\(([^()\s]+)\)", text):
        name, _, anchor = link.partition("#")
        target = page.parent / name if name else page
        if re.match(r"https?:", link) or target.name in MADE:
            continue
        heads = re.findall(r"^#+ (.*)", target.read_text(), re.M) if anchor else []
        anchors = {re.sub(r"\s+", "-", re.sub(r"[^\w\s-]", "", one.lower())) for one in heads}
        lost += [link] * (not target.exists() or anchor not in {"", *anchors})
    return lost


def find_slips(words: Counter[str], known: Counter[str]) -> dict[str, str]:
    """Words used once that are frequent ones but for a letter more, fewer or swapped inside."""
    found = {}
    for word in words:
        cuts = [(word[:at], word[at:]) for at in range(len(word) + 1)]
        near = {a + b[1:] for a, b in cuts[:-2]} | {a + b[1:2] + b[:1] + b[2:] for a, b in cuts}
        near |= {a + letter + b for a, b in cuts[:-1] for letter in "abcdefghijklmnopqrstuvwxyz"}
        best = max(near - {word}, key=lambda one: known[one])
        if known[word] == 1 and known[best] >= OFTEN and word not in RIGHT:
            found[word] = best
    return found


def test_links_lead_somewhere() -> None:
    """Links between pages, to pictures and to headings."""
    lost = {page.name: find_lost_links(page, page.read_text()) for page in PAGES}
    assert {name: links for name, links in lost.items() if links} == {}
    made_up = "[a](docs/none.md) [b](docs/jumps.md) [c](#none)"
    assert find_lost_links(ROOT / "README.md", made_up) == ["docs/none.md", "#none"]


def test_no_word_is_a_slip_of_a_frequent_one() -> None:
    """What a dictionary would find, without one; three made-up slips are found."""
    slips = {"settelment": "settlement", "frction": "friction", "ballasst": "ballast"}
    pages = " ".join([*slips, *(CODE.sub(" ", page.read_text()) for page in PAGES)])
    packages = ("trackbed", "adapters", "qdem_fem", "rigid_lcp", "track_line")
    code = " ".join(path.read_text() for one in packages for path in (ROOT / one).rglob("*.py"))
    words, others = (Counter(re.findall(r"[a-z]{6,}", one.lower())) for one in (pages, code))
    assert find_slips(words, words + others) == slips
