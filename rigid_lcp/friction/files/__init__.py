"""Friction problems as files: npz, FCLIB, Siconos."""
