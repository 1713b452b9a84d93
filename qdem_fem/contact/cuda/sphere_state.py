"""The contacts of spheres of a simulation on a GPU.

What contact remembers is on the GPU, from the first step to the last: pairs are looked for there,
and the host reads counts, greatest values, and what the last step said.  Who asks for arrays has a
copy of them as they are.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

from qdem_fem.contact import PARTED, Floats, SphereContacts
from qdem_fem.contact.cuda.arrays import DeviceContact
from qdem_fem.contact.cuda.sums import find_device_extents
from qdem_fem.contact.search import PeriodicWidth
from qdem_fem.contact.spheres import Contact
from qdem_fem.kernel.cuda import CudaAssembly, cuda


class CudaSphereContacts(SphereContacts):
    """`SphereContacts` whose steps and lists are those of `qdem_fem.contact.cuda.arrays`."""

    _host: Contact
    _device: DeviceContact
    _behind: bool
    """Whether the GPU has gone on since the host had its copy."""

    @property
    def kernel(self) -> Contact:
        """The arrays as the last step left them: a copy on the host, not to be written to."""
        if self._behind:
            self._host, self._behind = self._device.fetch(self._host), False
        return self._host

    @kernel.setter
    def kernel(self, value: Contact) -> None:
        self._host, self._behind = value, False
        self._device = DeviceContact(value, self.asked.periodic)

    @property
    def changing(self) -> DeviceContact:
        """The arrays on the GPU, about to be changed."""
        self._behind = True
        return self._device

    @cached_property
    def _constants(self) -> tuple[Any, Any, Any]:
        """``inverse_mass``, ``own`` and ``first_vertex`` on the GPU."""
        inverse_mass, own, first = (
            cuda.to_device(a) for a in (self.inverse_mass, self.own, self.first_vertex)
        )
        return inverse_mass, own, first

    def forget(self) -> None:
        """Let go of all springs."""
        self.changing.forget()

    def positions(self) -> Any:
        """`Contacts.positions`, on the GPU."""
        return self.changing.positions(self.run.assembly.state.displacement)

    def extents(self, position: Any, side: PeriodicWidth) -> Floats:
        """`Contacts.extents` of positions on the GPU."""
        found: Floats = find_device_extents(position, side.number, *self._constants[1:])
        return found

    def parted(self, position: Any) -> float:
        """`SphereContacts.parted` of positions on the GPU."""
        return PARTED * self._device.gap(position)

    def idle(self) -> int:
        """`SphereContacts.idle`"""
        return self._device.idle()

    def pairs_look(self, position: Any, skin: float) -> None:
        """`SphereContacts.pairs_look` around positions on the GPU."""
        self.changing.renew_lists(position, skin, self.skin / 2)

    def step_contact(self, step: float) -> int:
        """`Contacts.step_contact`"""
        state = self.run.assembly.state
        return self.changing.step_contact(state.displacement, state.velocity, step)

    def bound_present_stiffness(self) -> float:
        """`SphereContacts.bound_present_stiffness`"""
        return self._device.bound(self._constants[0])

    def march(self, steps: int, step: float, *given: Any) -> tuple[int, float, int]:
        """`Contacts.march` on the GPU."""
        assembly = self.run.assembly
        assert isinstance(assembly, CudaAssembly)
        loads, held, probes, table, gravity, work = given
        done, bad = assembly.run_kernel(
            assembly.state, steps, step, loads, held, probes, table, gravity, work, self.changing
        )
        return done, bad, self._device.said
