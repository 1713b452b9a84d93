"""The verbs ``doctor``, ``new`` and ``cite``."""

import argparse
import shlex
from pathlib import Path

from adapters.cli.arguments import add_json, print_json
from adapters.errors import EngineMissing, UsageError


def register(verb: str, parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``verb`` to its parser."""
    from trackbed.scenes import list_scenes

    if verb == "doctor":
        add_json(parser)
    elif verb == "new":
        parser.add_argument("name", metavar="NAME", help="; ".join(list_scenes()))
        parser.add_argument(
            "--list", action=ListScenes, nargs=0, help="print what each scene is, and end"
        )
        parser.add_argument("folder", metavar="FOLDER", type=Path, help="made when it is not there")
    parser.set_defaults(command={"doctor": run_doctor, "new": run_new, "cite": run_cite}[verb])


class ListScenes(argparse.Action):
    """Prints name, verb and title of the scenes that ship."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        """Print them; end with exit code 0."""
        from trackbed.scenes import find_scene_verb, list_scenes, read_title

        for name in list_scenes():
            print(f"{name:21}{find_scene_verb(name):7}{read_title(name)}")
        parser.exit()


def run_doctor(arguments: argparse.Namespace) -> int:
    """Print what is here and what is missing; `EngineMissing` when no engine is here."""
    from dataclasses import asdict

    from adapters.engines import ENGINE_REMEDY, has_usable_engine, list_findings

    found = list_findings()
    if arguments.json:
        print_json({"ok": has_usable_engine(found), "findings": [asdict(one) for one in found]})
    else:
        for one in found:
            version = one.version or ("missing" if one.remedy else "yes")
            print(f"{one.kind:9}{one.name:16}{version:28}  {one.where}".rstrip())
            if one.remedy:
                print(f"{'':9}-> {one.remedy}")
    if not has_usable_engine(found):
        raise EngineMissing("no engine is installed, so nothing can be run", remedy=ENGINE_REMEDY)
    return 0


def run_new(arguments: argparse.Namespace) -> int:
    """Copy a shipped scene to FOLDER/scene.toml; a scene that is there already is kept."""
    from trackbed.run_files import refuse_writing
    from trackbed.scene_files import suggest_word
    from trackbed.scenes import find_scene_verb, list_scenes, read_template

    names = list_scenes()
    if arguments.name not in names:
        raise UsageError(f"there is no scene {arguments.name}{suggest_word(arguments.name, names)}")
    path: Path = arguments.folder / "scene.toml"
    with refuse_writing(path.parent):
        path.parent.mkdir(parents=True, exist_ok=True)
    try:
        with path.open("x", encoding="utf-8") as stream:
            stream.write(read_template(arguments.name))
    except FileExistsError:
        raise UsageError(
            "this scene is there already and is kept", where=str(path),
            remedy="remove it first, or name another folder",
        ) from None  # fmt: skip
    verb = find_scene_verb(arguments.name)
    control = " --control" if verb == "run" else ""
    print(f"{path}\nnext: trackbed {verb} {shlex.quote(str(path))}{control}")
    return 0


def run_cite(arguments: argparse.Namespace) -> int:
    """Print BibTeX entries, each under a comment saying what it is cited for."""
    from trackbed import __version__

    entries = Path(__file__).with_name("citations.bib").read_text(encoding="utf-8")
    print(entries.replace("VERSION", __version__), end="")
    return 0
