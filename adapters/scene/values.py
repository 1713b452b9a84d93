"""The keys of a scene by name, as its checks read them."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from adapters.bed import Container, Radii, RadiusDistribution
from adapters.bed.stones import Form, find_form
from adapters.errors import DumpError, SceneError, UsageError
from adapters.scene.ballast import find_stored_radii, make_radii
from trackbed.scene_files import Problem


class NotValid(Exception):
    """A check asked for a key that is not valid in itself."""


class Values:
    """Keys of a scene by dotted name; to ask for one that is not valid raises `NotValid`."""

    def __init__(self, values: Mapping[str, Any], invalid: Iterable[str]) -> None:
        self._values, self._invalid = values, tuple(invalid)

    def get(self, key: str) -> Any:
        """A value, None where it is not given."""
        if any(key == bad or key.startswith(bad + ".") for bad in self._invalid):
            raise NotValid
        return self._values.get(key)

    def __getitem__(self, key: str) -> Any:
        """A value that must be there: without it the check is skipped."""
        value = self.get(key)
        if value is None:
            raise NotValid
        return value

    def has(self, key: str) -> bool:
        """Whether a key is given, valid or not; a table that is not valid is another problem."""
        try:
            return self.get(key) is not None or self.has_table(key)
        except NotValid:
            self.get(key.rpartition(".")[0])
            return True

    def has_table(self, name: str) -> bool:
        """Whether a table has any key."""
        self.get(name)
        return any(key.startswith(name + ".") for key in self._values)

    @property
    def radii_key(self) -> str:
        """The key that says how large grains are."""
        if self.has("sample.state"):
            return "sample.state"
        return "sample.grading" if self.has("sample.grading") else "sample.grain_radius.mean"

    @property
    def radii(self) -> Radii:
        """The radii of the grains, whether they make sense or not."""
        if self.has("sample.state"):
            try:
                return find_stored_radii(self["sample.state"])
            except (OSError, UsageError, DumpError) as error:
                raise NotValid from error
        if self.has("sample.grading"):
            return make_radii(self["sample.grading"], self.get("sample.grading_scale"))
        table = "sample.grain_radius."
        return RadiusDistribution(
            self[table + "distribution"],
            self[table + "mean"],
            self.get(table + "standard_deviation") or 0.0,
            self.get(table + "truncation") or 2.0,
        )

    @property
    def form(self) -> Form:
        """The form of the grains, of a valid name or file."""
        try:
            return find_form(self.get("sample.form"))
        except SceneError as error:
            raise NotValid from error

    @property
    def container(self) -> Container:
        """The container; of a valid shape, without mirror planes given twice."""
        shape, planes = self["sample.container"], self.get("sample.symmetry") or ()
        names = ("size_x", "size_y") if shape == "box" else ("radius",)
        sizes = {name: self[f"sample.{name}"] for name in names}
        return Container(shape, tuple(dict.fromkeys(planes)), **sizes)


Check = Callable[[Values], Iterator[Problem]]
"""What a check yields of a scene: nothing where all is well."""


def flatten_keys(table: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Values of nested tables by dotted key."""
    flat: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, dict):
            flat |= flatten_keys(value, f"{prefix}{key}.")
        else:
            flat[prefix + key] = value
    return flat
