"""Published curves of Chung and Ooi's tests 4 and 5, as read off the paper's figures.

The experiment is that of Kharaz, Gorham and Salman (2001), Powder Technology 120, 281-291:
5 mm spheres of aluminium oxide on a thick anvil of soda-lime glass at 3.9 m/s.  The finite
elements are those that Chung and Ooi show in test 5.  The points were read off Chung and Ooi's
figures by the Kratos project (DEMApplication, ``basic_benchmarks/paper_data``, BSD), signs of
spins turned here.  Where a grain slides all the time, and the answer is known, the points of the
elements are off by up to 0.07, the spins of the experiment by up to 37 rad/s.
"""

from __future__ import annotations

import numpy as np

EXPERIMENT_TANGENTIAL_RESTITUTION = np.array(
    [
        (2.24, 0.797), (4.22, 0.746), (9.84, 0.675), (20.22, 0.599), (30.36, 0.690),
        (39.54, 0.774), (49.60, 0.848), (71.07, 0.937), (79.23, 0.970), (85.17, 0.979),
    ]
)  # fmt: skip
"""Angle of incidence from the normal [deg], V_t'/V_t of the centre; test 4."""

EXPERIMENT_SPIN = np.array(
    [
        (5.90, 134.9), (10.87, 261.2), (21.12, 573.7), (31.14, 612.2), (38.95, 595.1),
        (50.24, 449.5), (60.10, 375.7), (69.96, 243.0), (78.56, 142.4), (84.32, 70.6),
    ]
)  # fmt: skip
"""Angle of incidence [deg], spin afterwards [rad/s]; test 4."""

ELEMENTS_REBOUND = np.array(
    [
        (0.006, -0.027), (0.272, -0.027), (0.586, -0.027), (0.876, -0.080), (1.190, -0.213),
        (1.553, -0.373), (1.915, -0.627), (2.314, -0.947), (2.785, -1.253), (3.317, -1.520),
        (3.970, -1.720), (4.755, -1.707), (5.758, -1.200), (7.124, 0.133), (9.118, 2.147),
        (12.356, 5.427),
    ]
)  # fmt: skip
"""Slip of the contact point before over mu V_n, and after; finite elements, test 5."""

ELEMENTS_SPIN = np.array(
    [
        (0.006, 0.0), (0.318, 0.187), (0.595, 0.406), (0.890, 0.665), (1.185, 0.982),
        (1.532, 1.355), (1.896, 1.793), (2.277, 2.321), (2.763, 2.856), (3.301, 3.441),
        (3.890, 4.041), (4.688, 4.569), (5.659, 4.941), (7.029, 4.941), (9.040, 4.972),
        (12.335, 4.970), (18.803, 4.975),
    ]
)  # fmt: skip
"""Slip of the contact point before over mu V_n, R omega'/(mu V_n); finite elements, test 5."""
