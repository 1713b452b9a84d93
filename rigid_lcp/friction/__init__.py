"""Friction problems: u = W r + q under unilateral contact and Coulomb's law."""
