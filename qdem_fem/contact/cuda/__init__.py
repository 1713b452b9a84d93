"""Contact of spheres on a GPU."""

from qdem_fem.contact.cuda.sphere_state import CudaSphereContacts

__all__ = ["CudaSphereContacts"]
