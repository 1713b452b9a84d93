"""The verbs of ``trackbed`` about deformable bodies; what they compute with loads when they run."""
