"""No page is older than the code that it measures, unless it says so and why."""

from __future__ import annotations

import ast

import pytest

from validation.age import (
    describe_age,
    digest_rooms,
    excuse_page,
    list_content,
    list_excuses,
    list_imports,
)
from validation.study import DOCS, find_record, list_studies, read_record

pytestmark = pytest.mark.studies
CODE = 'def double(a):\n    """Twice a."""\n    return 2 * a\n'


@pytest.mark.parametrize("name", list_studies())
def test_page_is_not_older_than_its_code(name: str) -> None:
    age, excuse = describe_age(name, read_record(find_record(name))), list_excuses().get(name)
    if excuse is None:
        assert not age, f"docs/{name}.md is out of date; {age}"
    else:
        assert age, f"{name} is as old as its code: take it out of validation/older.toml"
        assert excuse in DOCS.joinpath(f"{name}.md").read_text(encoding="utf-8")[:1000]


def test_excuses_are_of_studies() -> None:
    assert set(list_excuses()) <= set(list_studies())


def test_wording_and_layout_age_nothing_and_code_does() -> None:
    def read(code: str) -> object:
        return list_content(ast.parse(code))

    plain = read(CODE)
    assert read(CODE.replace("Twice", "Double").replace("2 * a", "(2 *\n  a)  # why")) == plain
    for other in ("3 * a", "2.0 * a", "False * a", "2 + a", "2 * b"):
        assert read(CODE.replace("2 * a", other)) != plain


def test_ways_to_import_a_name_age_nothing_and_another_name_does() -> None:
    def read(code: str) -> object:
        tree = ast.parse(code)
        return list_content(tree, list_imports(tree))

    plain = read("from a.b import c\nx = c(1)")
    assert read("from a import b\nx = b.c(1)") == read("import a.b as d\nx = d.c(1)") == plain
    for other in ("from a.b import d\nx = d(1)", "x = c(1)", "from a import b\nx = b.c.d(1)"):
        assert read(other) != plain


def test_age_names_parts_and_rooms() -> None:
    rooms = digest_rooms("laws")
    rows = [{"part": "new", "code": rooms}, {"part": "old", "code": {}}, {"part": "older"}]
    assert describe_age("laws", rows[:1]) == ""
    assert describe_age("laws", rows) == "laws: older than adapters.laws: old, older"


def test_excused_page_says_so_below_its_title(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("validation.age.list_excuses", lambda: {"laws": "no time."})
    page = excuse_page("laws", "# Laws\n\nText.\n")
    assert page == "# Laws\n\n**Older than the code that it measures**: no time.\n\nText.\n"
    assert excuse_page("paper", "# Paper\n") == "# Paper\n"
