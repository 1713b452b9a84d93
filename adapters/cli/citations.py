"""What to cite for the methods and engines used, as BibTeX."""

from __future__ import annotations

CITATIONS = (
    ("the jump procedure, its laws and its relaxation", r"""@article{karrech2007,
  author  = {Karrech, A. and Duhamel, D. and Bonnet, G. and Roux, J.-N. and Chevoir, F. and
             Canou, J. and Dupla, J.-C. and Sab, K.},
  title   = {A computational procedure for the prediction of settlement in granular materials
             under cyclic loading},
  journal = {Computer Methods in Applied Mechanics and Engineering},
  volume  = {197}, number = {1--4}, pages = {80--94}, year = {2007},
  doi     = {10.1016/j.cma.2007.07.011}
}"""),
    ("viscoelastic bodies and the ballasted track (qdem)", r"""@article{nishiura2017,
  author  = {Nishiura, Daisuke and Sakaguchi, Hide and Aikawa, Akira},
  title   = {Development of viscoelastic multi-body simulation and impact response analysis of a
             ballasted railway track under cyclic loading},
  journal = {Materials},
  volume  = {10}, number = {6}, pages = {615}, year = {2017},
  doi     = {10.3390/ma10060615}
}"""),
    ("rigid grains (rigid)", r"""@incollection{schwager2002,
  author    = {Schwager, Thomas and P{\"o}schel, Thorsten},
  title     = {Rigid body dynamics of railway ballast},
  booktitle = {System Dynamics of Long-Term Behaviour of Railway Vehicles, Track and Subgrade},
  editor    = {Popp, K. and Schiehlen, W.},
  series    = {Lecture Notes in Applied Mechanics}, publisher = {Springer}, year = {2002}
}"""),
    ("the engine LIGGGHTS", r"""@article{kloss2012,
  author  = {Kloss, Christoph and Goniva, Christoph and Hager, Alice and Amberger, Stefan and
             Pirker, Stefan},
  title   = {Models, algorithms and validation for opensource {DEM} and {CFD-DEM}},
  journal = {Progress in Computational Fluid Dynamics},
  volume  = {12}, number = {2/3}, pages = {140--152}, year = {2012},
  doi     = {10.1504/PCFD.2012.047457}
}"""),
    ("trackbed itself", r"""@software{trackbed,
  author  = {{The trackbed authors}},
  title   = {trackbed: how railway ballast settles, vibrates and breaks},
  version = {VERSION}
}"""),
)  # fmt: skip
"""Pairs (what it is cited for, BibTeX entry)."""
