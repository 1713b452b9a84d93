"""SHA-256 of what engines read of scenes without gradings, rolling friction, blocks and stages.

Rows of a study are as old as these digests: `validation.age`.
"""

DECKS = {"liggghts": "7ae70ebe534b6102", "lammps": "350c419fdc85a24d", "yade": "518db570af9e66ad"}
"""Of names and texts of all files but restarts and YADE's scripts, which read the rest."""

RAIN = {"liggghts": "b13309a97f01208f", "lammps": "2fe0e0156d57a6ec", "yade": "251d2450327da4aa"}
"""Of the rain of each shipped scene with a bed, for two seeds."""
