"""trackbed: the command, and the floor that the three stories stand on."""

__version__ = "0.2.0"
