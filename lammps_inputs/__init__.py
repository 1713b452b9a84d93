"""Static LAMMPS decks; they also run by hand: see in.prepare and in.cycles."""
