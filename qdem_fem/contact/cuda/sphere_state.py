"""The contacts of spheres of a simulation on a GPU.

What contact remembers is on the GPU, from the first step to the last: pairs are looked for there,
and the host reads counts, greatest values, and what the last step said.  Who asks for arrays has a
copy of them as they are.
"""

from functools import cached_property
from typing import Any

from qdem_fem.bodies import Given
from qdem_fem.contact import PARTED, SphereContacts
from qdem_fem.contact.cuda.arrays import DeviceContact
from qdem_fem.contact.cuda.sums import (
    bound_present,
    count_idle,
    find_device_extents,
    find_gap,
    find_positions,
)
from qdem_fem.contact.search import PeriodicWidth
from qdem_fem.contact.spheres import Contact
from qdem_fem.files import Floats
from qdem_fem.kernel.cuda import CudaAssembly, cuda


class CudaSphereContacts(SphereContacts):
    """`SphereContacts` whose steps and lists are those of `qdem_fem.contact.cuda.arrays`."""

    _host: Contact
    _device: DeviceContact
    _behind: bool  # whether the GPU has gone on since the host had its copy

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
    def _constants(self) -> tuple[Any, Any]:
        """``inverse_mass`` and ``first_vertex`` on the GPU."""
        return cuda.to_device(self.inverse_mass), cuda.to_device(self.first_vertex)

    def forget(self) -> None:
        self.changing.forget()

    def positions(self) -> Any:
        on = self.changing.on
        return on.position if find_positions(on, self.run.assembly.state.displacement) else None

    def extents(self, position: Any, side: PeriodicWidth) -> Floats:
        found: Floats = find_device_extents(position, side.number, self._constants[1])
        return found

    def measure_gap(self, position: Any) -> float:
        return PARTED * find_gap(self._device.on, position, self._device.walls)

    def count_idle_pairs(self) -> int:
        return count_idle(self._device.on)

    def look_for_pairs(self, position: Any, skin: float) -> None:
        self.changing.renew_lists(position, skin, self.skin / 2)

    def step_contact(self, step: float) -> int:
        state = self.run.assembly.state
        return self.changing.step_contact(state.displacement, state.velocity, step)

    def bound_present_stiffness(self) -> float:
        return bound_present(self._device.on, self._device.walls, self._constants[0])

    def march(self, steps: int, step: float, given: Given, work: Floats) -> tuple[int, float, int]:
        assembly = self.run.assembly
        assert isinstance(assembly, CudaAssembly)
        done, bad = assembly.run_kernel(assembly.state, steps, step, given, work, self.changing)
        return done, bad, self._device.said
