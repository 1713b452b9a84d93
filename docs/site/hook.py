"""What MkDocs calls: pages that are not in ``docs/``, links out of it, comments as docstrings."""

from __future__ import annotations

import inspect
import re
import sys
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages
from typing import Any

import griffe
from mkdocs.structure.files import File

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(Path(__file__).parent)]

from reference import PACKAGES, write_keys, write_verbs  # noqa: E402

from trackbed import STORIES  # noqa: E402

MOVED = {
    "README.md": "index.md",
    "CHANGELOG.md": "changes.md",
    "CONTRIBUTING.md": "contributing.md",
}
"""Pages at the top of the repository, and their names here."""


def write_words(package: str) -> str:
    """The page of a package's public words, its own or else those of its rooms; mkdocstrings puts
    in what each class and function is."""
    module = import_module(package)
    homes = {package: module}
    if not hasattr(module, "__all__"):
        rooms = [one.name for one in walk_packages(module.__path__, f"{package}.") if one.ispkg]
        homes = {room: import_module(room) for room in rooms}
    words = {home: getattr(one, "__all__", ()) for home, one in homes.items()}
    if package == "trackbed":
        words = {home: (word,) for word, home in STORIES.items()} | words
    parts = [f"# {package}\n"]
    for home, found in words.items():
        parts += [f"\n## `{home}`\n\n{inspect.getdoc(import_module(home))}\n\n"] * bool(found)
        kinds = {word: callable(getattr(import_module(home), word)) for word in found}
        parts += [f"::: {home}.{word}\n\n" for word in found if kinds[word]]
        others = ", ".join(f"`{word}`" for word in found if not kinds[word])
        parts += [f"Constants, types and modules: {others}.\n"] * bool(others)
    return "".join(parts)


def write_gallery() -> str:
    """The page of all pictures, each with its script."""
    parts = [
        "# Gallery\n\nEach picture is drawn by the script below it, at the top of the repository: "
        "`PYTHONPATH=. python SCRIPT PICTURE`.\n"
    ]
    for script in sorted(ROOT.glob("docs/gallery/*.py")):
        text = script.read_text(encoding="utf-8")
        title, _, said = text.split('"""')[1].partition("\n")
        picture = f"![{title}](gallery/{script.stem}.png)"
        if not script.with_suffix(".png").exists():
            picture = "*Not drawn yet: `make docs` draws it.*"
        code = f'??? example "docs/gallery/{script.name}"\n    ```python\n'
        code += "".join(f"    {line}\n" for line in text.splitlines()) + "    ```\n"
        parts.append(f"\n## {title.rstrip('.')}\n\n{said.strip()}\n\n{picture}\n\n{code}")
    return "".join(parts)


def on_files(files: Any, config: Any) -> Any:
    """Add the pages that are made here."""
    made = {"gallery.md": write_gallery(), "keys.md": write_keys(), "verbs.md": write_verbs()}
    made |= {f"api/{package}.md": write_words(package) for package in PACKAGES}
    for name, here in MOVED.items():
        made[here] = (ROOT / name).read_text(encoding="utf-8").replace("](docs/", "](")
    for path, text in made.items():
        files.append(File.generated(config, path, content=text))
    return files


def on_page_markdown(markdown: str, *, page: Any, config: Any, files: Any) -> str:
    """Links to files outside ``docs/`` lead to the repository; lists in lists are indented by
    four, as Python-Markdown asks."""

    def lead(link: re.Match[str]) -> str:
        name = link[1].removeprefix("../")
        if not (ROOT / name).is_file():
            return link[0]
        return f"]({MOVED.get(name) or f'{config.repo_url}/blob/main/{name}'})"

    markdown = re.sub(r"\]\(((?:\.\./)?[^)#:]+)\)", lead, markdown)
    return re.sub(r"^ {3}(?=\S)", "    ", markdown, flags=re.MULTILINE)


class Comments(griffe.Extension):
    """The comment at the end of an attribute's line is its docstring, where it has none."""

    def on_attribute_instance(self, *, node: Any, attr: griffe.Attribute, **_: Any) -> None:
        """Called for each attribute that is read."""
        said = attr.lines[-1].partition("  # ")[2] if attr.lines else ""
        if attr.docstring is None and said and not said.startswith(("type:", "fmt:", "noqa")):
            attr.docstring = griffe.Docstring(said, parent=attr)
