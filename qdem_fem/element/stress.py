"""What all strain measures share, written once for numbers, arrays, lanes and GPU.

Every function takes the displacement gradient ``H = F - I`` as nine values in rows and gives ``P``,
the nominal stress of which the nodal forces are ``f_a = -V0 P grad N_a`` (`compute_element_pulls`).
Only ``+ - * /`` are used, so a value may be a number, an array, `qdem_fem.kernel.cpu.lanes.Lanes`
or a register of a GPU.  ``half`` is 0.5 in the precision of the values: a literal 0.5 would turn
single precision on a GPU into double.  With ``lame_*`` times the volume, ``P`` comes times it.

All are in displacement form: a strain of 1e-9 keeps its full relative precision, nothing is
subtracted from the identity.  Tests compare with readable twins and the paper's own construction.
"""

from typing import Any

Nine = tuple[Any, Any, Any, Any, Any, Any, Any, Any, Any]
"""A 3 x 3 matrix in rows."""


def compute_element_gradient(e: Nine, g: Nine) -> Nine:
    """``H = sum_a e_a (x) grad N_a`` of eq. 1, from the edges of a nodal field.

    ``e``: the field at corners 1, 2, 3 less that at corner 0, three components each [m];
    ``g``: reference gradients of the shape functions of corners 1, 2, 3 [1/m].
    """
    return (
        e[0] * g[0] + e[3] * g[3] + e[6] * g[6],
        e[0] * g[1] + e[3] * g[4] + e[6] * g[7],
        e[0] * g[2] + e[3] * g[5] + e[6] * g[8],
        e[1] * g[0] + e[4] * g[3] + e[7] * g[6],
        e[1] * g[1] + e[4] * g[4] + e[7] * g[7],
        e[1] * g[2] + e[4] * g[5] + e[7] * g[8],
        e[2] * g[0] + e[5] * g[3] + e[8] * g[6],
        e[2] * g[1] + e[5] * g[4] + e[8] * g[7],
        e[2] * g[2] + e[5] * g[5] + e[8] * g[8],
    )


def compute_element_pulls(p: Nine, g: Nine) -> Nine:
    """``P grad N_a`` of corners 1, 2, 3: what eqs 9 and 10 sum up, with the sign turned.

    The force on corner a is minus this; that on corner 0 is the sum of the three.
    """
    return (
        p[0] * g[0] + p[1] * g[1] + p[2] * g[2],
        p[3] * g[0] + p[4] * g[1] + p[5] * g[2],
        p[6] * g[0] + p[7] * g[1] + p[8] * g[2],
        p[0] * g[3] + p[1] * g[4] + p[2] * g[5],
        p[3] * g[3] + p[4] * g[4] + p[5] * g[5],
        p[6] * g[3] + p[7] * g[4] + p[8] * g[5],
        p[0] * g[6] + p[1] * g[7] + p[2] * g[8],
        p[3] * g[6] + p[4] * g[7] + p[5] * g[8],
        p[6] * g[6] + p[7] * g[7] + p[8] * g[8],
    )


def find_viscous_stress(
    h: Nine, d: Nine, viscous_first: Any, viscous_second: Any, half: Any
) -> Nine:
    """``P = T_D cof F`` with ``T_D = lambda_D tr(D) I + 2 mu_D D``, ``L = Hdot F^-1`` (eqs 5-7).

    ``d``: rate of the displacement gradient [1/s]; viscosities [Pa s].  With ``C = cof F``,
    ``L = Hdot C^T / J``.
    """
    h0, h1, h2, h3, h4, h5, h6, h7, h8 = h
    one = half + half
    f0, f4, f8 = one + h0, one + h4, one + h8
    c0, c1, c2 = f4 * f8 - h5 * h7, h5 * h6 - h3 * f8, h3 * h7 - f4 * h6
    c3, c4, c5 = h2 * h7 - h1 * f8, f0 * f8 - h2 * h6, h1 * h6 - f0 * h7
    c6, c7, c8 = h1 * h5 - h2 * f4, h2 * h3 - f0 * h5, f0 * f4 - h1 * h3
    inverse = one / (f0 * c0 + h1 * c1 + h2 * c2)
    first, second = viscous_first * inverse, viscous_second * inverse
    twice = second + second
    lxx = d[0] * c0 + d[1] * c1 + d[2] * c2
    lyy = d[3] * c3 + d[4] * c4 + d[5] * c5
    lzz = d[6] * c6 + d[7] * c7 + d[8] * c8
    txy = second * ((d[0] * c3 + d[1] * c4 + d[2] * c5) + (d[3] * c0 + d[4] * c1 + d[5] * c2))
    txz = second * ((d[0] * c6 + d[1] * c7 + d[2] * c8) + (d[6] * c0 + d[7] * c1 + d[8] * c2))
    tyz = second * ((d[3] * c6 + d[4] * c7 + d[5] * c8) + (d[6] * c3 + d[7] * c4 + d[8] * c5))
    pressure = first * (lxx + lyy + lzz)
    txx, tyy, tzz = pressure + twice * lxx, pressure + twice * lyy, pressure + twice * lzz
    return (
        txx * c0 + txy * c3 + txz * c6,
        txx * c1 + txy * c4 + txz * c7,
        txx * c2 + txy * c5 + txz * c8,
        txy * c0 + tyy * c3 + tyz * c6,
        txy * c1 + tyy * c4 + tyz * c7,
        txy * c2 + tyy * c5 + tyz * c8,
        txz * c0 + tyz * c3 + tzz * c6,
        txz * c1 + tyz * c4 + tzz * c7,
        txz * c2 + tyz * c5 + tzz * c8,
    )


def find_matrix_product(p: Nine, d: Nine) -> Any:
    """``P : Hdot``, the power of a stress [W/m^3] at a rate of the displacement gradient [1/s]."""
    return (
        p[0] * d[0] + p[1] * d[1] + p[2] * d[2] + p[3] * d[3] + p[4] * d[4] + p[5] * d[5]
        + p[6] * d[6] + p[7] * d[7] + p[8] * d[8]
    )  # fmt: skip
