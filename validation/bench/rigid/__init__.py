"""Rigid contact: scenes with known answers, packings, and friction problems made to measure."""
