"""What other tools get of grains and contacts: only what the scene names, in SI units."""

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from adapters.bed import IntArray
from adapters.report.export.instants import ExportedRun, Instant

Array = NDArray[np.float64] | NDArray[np.int64]


def gather_grains(run: ExportedRun, instant: Instant) -> dict[str, Array]:
    """Fields of the grains by name, shape (n,) or (n, 3).

    ``id``; ``radius`` [m]; ``displacement`` since cycle 0 [m], where there are load cycles, and of
    stones their ``rotation`` [rad], a vector;
    ``velocity`` [m/s]; ``coordination``, contacts with other grains.
    """
    state = instant.state
    fields: dict[str, Array] = {"id": state.identifier, "radius": state.radius}
    if run.loaded:
        fields["displacement"] = instant.displacement
        if instant.rotation is not None:
            fields["rotation"] = instant.rotation
    fields["velocity"] = state.velocity
    return fields | ({"coordination": instant.coordination} if run.own else {})


def gather_placed_grains(run: ExportedRun, instant: Instant) -> dict[str, Array]:
    """`gather_grains` with the places of the centres [m] behind ``id``, without a name."""
    fields = gather_grains(run, instant)
    return {"id": fields.pop("id"), "": instant.state.position} | fields


def gather_contacts(run: ExportedRun, instant: Instant) -> dict[str, Array]:
    """Fields of the contacts between grains by name, shape (m,) or (m, 3).

    ``normal_force`` [N], positive where it pushes the grains apart; ``tangential_force`` on the
    grain named first [N], where there is friction.
    """
    contacts, pair = instant.state.contacts, list_contacts(instant)
    apart = instant.state.position[pair[:, 0]] - instant.state.position[pair[:, 1]]
    push = np.einsum("ma,ma->m", contacts.normal_force, apart)
    fields: dict[str, Array] = {"normal_force": push / np.linalg.norm(apart, axis=1)}
    if run.own and run.scene.material.grain.friction > 0:
        fields["tangential_force"] = contacts.tangential_force
    return fields


def gather_named_contacts(run: ExportedRun, instant: Instant) -> dict[str, Array]:
    """`gather_contacts` behind the identifiers of the two grains, ``id1`` and ``id2``."""
    first, second = instant.state.contacts.pair.T
    return {"id1": first, "id2": second} | gather_contacts(run, instant)


def list_contacts(instant: Instant) -> IntArray:
    """Rows of the two grains of every contact among the grains, shape (m, 2)."""
    return np.searchsorted(instant.state.identifier, instant.state.contacts.pair)


def split_columns(fields: Mapping[str, Array], join: str) -> Iterator[tuple[str, Array]]:
    """Fields as columns: the components of a vector are name, ``join`` and x, y or z.

    A vector without a name is a place: its components are x, y and z.
    """
    for name, values in fields.items():
        if values.ndim == 1:
            yield name, values
        else:
            for axis, column in zip("xyz", values.T, strict=True):
                yield (name + join if name else "") + axis, column
