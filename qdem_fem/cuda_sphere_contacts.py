"""The contacts of spheres of a simulation on a GPU.

Pairs are looked for on the processor, by its cell list, when a vertex has left the skin: on a bed
at rest hardly ever.  From window to window of a march what contact remembers stays on the GPU,
until the host asks for it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from qdem_fem.contact_kernel import Contact
from qdem_fem.contact_sphere_state import SphereContacts

if TYPE_CHECKING:
    from qdem_fem.cuda_contact import DeviceContact


class CudaSphereContacts(SphereContacts):
    """`SphereContacts` whose steps are those of `qdem_fem.cuda_contact`."""

    _host: Contact
    _device: DeviceContact | None = None

    @property
    def kernel(self) -> Contact:
        """The arrays on the host, as the last step left them; who asks may change them."""
        if self._device is not None:
            self._device.fetch(self._host)
            self._device = None
        return self._host

    @kernel.setter
    def kernel(self, value: Contact) -> None:
        self._host, self._device = value, None

    def march(self, steps: int, step: float, *given: Any) -> tuple[int, float, int]:
        """`Contacts.march` on the GPU."""
        from qdem_fem.cuda_assembly import CudaAssembly
        from qdem_fem.cuda_contact import DeviceContact

        assembly = self.run.assembly
        assert isinstance(assembly, CudaAssembly)
        if self._device is None:
            self._device = DeviceContact(self._host)
        loads, held, probes, table, gravity, work = given
        done, bad = assembly.kernel_run(
            assembly.state, steps, step, loads, held, probes, table, gravity, work, self._device
        )
        return done, bad, self._device.said
