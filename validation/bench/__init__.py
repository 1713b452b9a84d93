"""Timings and problems that several studies and tests share: races, packings, scenes."""
