"""QDEM on a GPU beside the processor: contact, the search for pairs, a packing."""
