"""Elastic and viscous stress of an element, written once for numbers, arrays, lanes and GPU.

Every function takes the displacement gradient ``H = F - I`` as nine values in rows and gives
``P``, the nominal stress of which the nodal forces are ``f_a = -V0 P grad N_a`` (`element_pulls`).
Only ``+ - * /`` are used, so a value may be a number, a NumPy array, `qdem_fem.lanes.Lanes` or a
register of a GPU.  ``half`` is 0.5 in the precision of the values: a literal 0.5 would turn
single precision on a GPU into double.  With ``lame_*`` times the volume, ``P`` comes times it.

All are in displacement form: a strain of 1e-9 keeps its full relative precision, nothing is
subtracted from the identity.  Readable twins on arrays: `qdem_fem.reference_forces`; the paper's
own construction: `qdem_fem.construction`.
"""

from __future__ import annotations

from typing import Any

Nine = tuple[Any, Any, Any, Any, Any, Any, Any, Any, Any]
"""A 3 x 3 matrix in rows."""


def element_gradient(e: Nine, g: Nine) -> Nine:
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


def element_pulls(p: Nine, g: Nine) -> Nine:
    """``P grad N_a`` of corners 1, 2, 3: what eqs. 9 and 10 sum up, with the sign turned.

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


def stress_finger(h: Nine, lame_first: Any, lame_second: Any, half: Any) -> tuple[Nine, Any]:
    """``P = T cof F`` with ``T = lambda tr(eps) I + 2 mu eps``, ``eps = (B - I)/2`` (eqs. 2-4).

    Since ``B cof F = J F``, with ``K = H^T - cof H``, ``II = tr cof H``, ``III = det H``::

        P = a cof F + mu (J F - cof F) = alpha I + beta H + gamma K,   a = lambda tr(eps),
        alpha = a (1 + tr H) + mu (II + III),  beta = mu J,  gamma = mu - a.

    Returns ``P`` and ``J = det F``.  Not hyperelastic unless ``lambda = mu``: a closed cycle of
    strain e leaves work of the order e times the energy stored; `stress_svk` leaves none.
    """
    h0, h1, h2, h3, h4, h5, h6, h7, h8 = h
    c0, c1, c2 = h4 * h8 - h5 * h7, h5 * h6 - h3 * h8, h3 * h7 - h4 * h6
    c3, c4, c5 = h2 * h7 - h1 * h8, h0 * h8 - h2 * h6, h1 * h6 - h0 * h7
    c6, c7, c8 = h1 * h5 - h2 * h4, h2 * h3 - h0 * h5, h0 * h4 - h1 * h3
    trace = h0 + h4 + h8
    change = (c0 + c4 + c8) + (h0 * c0 + h1 * c1 + h2 * c2)
    squares = (
        h0 * h0 + h1 * h1 + h2 * h2 + h3 * h3 + h4 * h4 + h5 * h5 + h6 * h6 + h7 * h7 + h8 * h8
    )
    pressure = lame_first * (trace + half * squares)
    alpha = (pressure + pressure * trace) + lame_second * change
    volume_change = trace + change
    beta = lame_second + lame_second * volume_change
    gamma = lame_second - pressure
    stress = (
        (alpha + beta * h0) + gamma * (h0 - c0),
        beta * h1 + gamma * (h3 - c1),
        beta * h2 + gamma * (h6 - c2),
        beta * h3 + gamma * (h1 - c3),
        (alpha + beta * h4) + gamma * (h4 - c4),
        beta * h5 + gamma * (h7 - c5),
        beta * h6 + gamma * (h2 - c6),
        beta * h7 + gamma * (h5 - c7),
        (alpha + beta * h8) + gamma * (h8 - c8),
    )
    return stress, (half + half) + volume_change


def stress_small(h: Nine, lame_first: Any, lame_second: Any, half: Any) -> tuple[Nine, Any]:
    """Linear elasticity, ``P = lambda tr(H) I + mu (H + H^T)``; with it the method is linear FEM.

    Returns 1 for ``J`` (NaN where ``H`` is not finite).  Not for bodies that turn: a rotation by
    the angle t is taken for a strain of t^2/2.
    """
    h0, h1, h2, h3, h4, h5, h6, h7, h8 = h
    trace = h0 + h4 + h8
    pressure = lame_first * trace
    twice = lame_second + lame_second
    xy, xz, yz = lame_second * (h1 + h3), lame_second * (h2 + h6), lame_second * (h5 + h7)
    stress = (
        pressure + twice * h0, xy, xz, xy, pressure + twice * h4, yz, xz, yz, pressure + twice * h8
    )  # fmt: skip
    return stress, (half + half) + (trace - trace)


def stress_svk(h: Nine, lame_first: Any, lame_second: Any, half: Any) -> tuple[Nine, Any]:
    """St. Venant-Kirchhoff, ``P = F S``, ``S = lambda tr(E) I + 2 mu E``, ``E = (F^T F - I)/2``.

    Conservative and exact under rotation.  Returns ``P`` and ``J``.  Not for strong compression:
    it softens, and has no stiffness at ``F = 0.58 I``.
    """
    h0, h1, h2, h3, h4, h5, h6, h7, h8 = h
    xx = (h0 + h0) + (h0 * h0 + h3 * h3 + h6 * h6)  # 2 E
    yy = (h4 + h4) + (h1 * h1 + h4 * h4 + h7 * h7)
    zz = (h8 + h8) + (h2 * h2 + h5 * h5 + h8 * h8)
    xy = (h1 + h3) + (h0 * h1 + h3 * h4 + h6 * h7)
    xz = (h2 + h6) + (h0 * h2 + h3 * h5 + h6 * h8)
    yz = (h5 + h7) + (h1 * h2 + h4 * h5 + h7 * h8)
    pressure = lame_first * half * (xx + yy + zz)
    sxx, syy, szz = (
        pressure + lame_second * xx,
        pressure + lame_second * yy,
        pressure + lame_second * zz,
    )
    sxy, sxz, syz = lame_second * xy, lame_second * xz, lame_second * yz
    stress = (
        sxx + (h0 * sxx + h1 * sxy + h2 * sxz),
        sxy + (h0 * sxy + h1 * syy + h2 * syz),
        sxz + (h0 * sxz + h1 * syz + h2 * szz),
        sxy + (h3 * sxx + h4 * sxy + h5 * sxz),
        syy + (h3 * sxy + h4 * syy + h5 * syz),
        syz + (h3 * sxz + h4 * syz + h5 * szz),
        sxz + (h6 * sxx + h7 * sxy + h8 * sxz),
        syz + (h6 * sxy + h7 * syy + h8 * syz),
        szz + (h6 * sxz + h7 * syz + h8 * szz),
    )  # fmt: skip
    one = half + half
    f0, f4, f8 = one + h0, one + h4, one + h8
    jacobian = f0 * (f4 * f8 - h5 * h7) + h1 * (h5 * h6 - h3 * f8) + h2 * (h3 * h7 - f4 * h6)
    return stress, jacobian


def stress_corotational(h: Nine, lame_first: Any, lame_second: Any, half: Any) -> tuple[Nine, Any]:
    """``P = R (lambda tr(Y) I + 2 mu Y)``, with ``F = R (I + Y)``: Hooke's law in the turned frame.

    The stretch ``Y`` solves ``Y^2 + 2 Y = F^T F - I`` by six Newton steps from ``Y = 0``
    (quadratic; to round-off for stretches between 0.3 and 3), so that nothing is lost at small
    strain.  Conservative: ``W = mu Y:Y + lambda/2 tr(Y)^2``.  Returns ``P`` and ``J``.
    """
    h0, h1, h2, h3, h4, h5, h6, h7, h8 = h
    one = half + half
    xx = (h0 + h0) + (h0 * h0 + h3 * h3 + h6 * h6)  # F^T F - I
    yy = (h4 + h4) + (h1 * h1 + h4 * h4 + h7 * h7)
    zz = (h8 + h8) + (h2 * h2 + h5 * h5 + h8 * h8)
    xy = (h1 + h3) + (h0 * h1 + h3 * h4 + h6 * h7)
    xz = (h2 + h6) + (h0 * h2 + h3 * h5 + h6 * h8)
    yz = (h5 + h7) + (h1 * h2 + h4 * h5 + h7 * h8)
    nought = xx - xx
    y0, y1, y2, y3, y4, y5 = nought, nought, nought, nought, nought, nought  # xx xy xz yy yz zz
    i0, i1, i2 = one + nought, nought, nought  # (I + Y)^-1
    i3, i4, i5 = one + nought, nought, one + nought
    determinant = one + nought
    for _ in range(6):
        a0 = xx + (y0 * y0 + y1 * y1 + y2 * y2)
        a1 = xy + (y0 * y1 + y1 * y3 + y2 * y4)
        a2 = xz + (y0 * y2 + y1 * y4 + y2 * y5)
        a3 = yy + (y1 * y1 + y3 * y3 + y4 * y4)
        a4 = yz + (y1 * y2 + y3 * y4 + y4 * y5)
        a5 = zz + (y2 * y2 + y4 * y4 + y5 * y5)
        y0 = half * (i0 * a0 + i1 * a1 + i2 * a2)
        y1 = half * (i0 * a1 + i1 * a3 + i2 * a4)
        y2 = half * (i0 * a2 + i1 * a4 + i2 * a5)
        y3 = half * (i1 * a1 + i3 * a3 + i4 * a4)
        y4 = half * (i1 * a2 + i3 * a4 + i4 * a5)
        y5 = half * (i2 * a2 + i4 * a4 + i5 * a5)
        u0, u3, u5 = one + y0, one + y3, one + y5
        i0, i1, i2 = u3 * u5 - y4 * y4, y2 * y4 - y1 * u5, y1 * y4 - y2 * u3
        i3, i4, i5 = u0 * u5 - y2 * y2, y1 * y2 - u0 * y4, u0 * u3 - y1 * y1
        determinant = u0 * i0 + y1 * i1 + y2 * i2
        inverse = one / determinant
        i0, i1, i2 = i0 * inverse, i1 * inverse, i2 * inverse
        i3, i4, i5 = i3 * inverse, i4 * inverse, i5 * inverse
    pressure = lame_first * (y0 + y3 + y5)
    twice = lame_second + lame_second
    b0, b1, b2 = pressure + twice * y0, twice * y1, twice * y2  # Biot stress
    b3, b4, b5 = pressure + twice * y3, twice * y4, pressure + twice * y5
    s0 = i0 * b0 + i1 * b1 + i2 * b2  # (I + Y)^-1 and the Biot stress commute
    s1 = i0 * b1 + i1 * b3 + i2 * b4
    s2 = i0 * b2 + i1 * b4 + i2 * b5
    s3 = i1 * b1 + i3 * b3 + i4 * b4
    s4 = i1 * b2 + i3 * b4 + i4 * b5
    s5 = i2 * b2 + i4 * b4 + i5 * b5
    stress = (
        s0 + (h0 * s0 + h1 * s1 + h2 * s2),
        s1 + (h0 * s1 + h1 * s3 + h2 * s4),
        s2 + (h0 * s2 + h1 * s4 + h2 * s5),
        s1 + (h3 * s0 + h4 * s1 + h5 * s2),
        s3 + (h3 * s1 + h4 * s3 + h5 * s4),
        s4 + (h3 * s2 + h4 * s4 + h5 * s5),
        s2 + (h6 * s0 + h7 * s1 + h8 * s2),
        s4 + (h6 * s1 + h7 * s3 + h8 * s4),
        s5 + (h6 * s2 + h7 * s4 + h8 * s5),
    )
    f0, f4, f8 = one + h0, one + h4, one + h8
    jacobian = f0 * (f4 * f8 - h5 * h7) + h1 * (h5 * h6 - h3 * f8) + h2 * (h3 * h7 - f4 * h6)
    return stress, jacobian


def viscous_current(h: Nine, d: Nine, viscous_first: Any, viscous_second: Any, half: Any) -> Nine:
    """``P = T_D cof F`` with ``T_D = lambda_D tr(D) I + 2 mu_D D``, ``L = Hdot F^-1`` (eqs. 5-7).

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


def pulls_finger_viscous(
    h: Nine, w: Nine, g: Nine, lame_first: Any, lame_second: Any, viscous_first: Any,
    viscous_second: Any, half: Any,
) -> tuple[Nine, Any, Any]:  # fmt: skip
    """`element_pulls` of `stress_finger` and `viscous_current` together, with less work.

    With ``c_a = cof(F) grad N_a``, which is ``J`` times the gradient in the current
    configuration: ``J L = sum_a w_a (x) c_a`` (eq. 5) and ``f_a = -V0 T c_a`` (eqs. 8-10).
    ``w``: edges of the velocity [m/s], as the edges of `element_gradient`.  Returns the pulls,
    ``J`` and the power that viscosity takes, ``V0 J T_D : D`` [W].
    """
    h0, h1, h2, h3, h4, h5, h6, h7, h8 = h
    one = half + half
    f0, f4, f8 = one + h0, one + h4, one + h8
    c0, c1, c2 = f4 * f8 - h5 * h7, h5 * h6 - h3 * f8, h3 * h7 - f4 * h6
    c3, c4, c5 = h2 * h7 - h1 * f8, f0 * f8 - h2 * h6, h1 * h6 - f0 * h7
    c6, c7, c8 = h1 * h5 - h2 * f4, h2 * h3 - f0 * h5, f0 * f4 - h1 * h3
    jacobian = f0 * c0 + h1 * c1 + h2 * c2
    inverse = one / jacobian
    ax, ay, az = (
        c0 * g[0] + c1 * g[1] + c2 * g[2],
        c3 * g[0] + c4 * g[1] + c5 * g[2],
        c6 * g[0] + c7 * g[1] + c8 * g[2],
    )
    bx, by, bz = (
        c0 * g[3] + c1 * g[4] + c2 * g[5],
        c3 * g[3] + c4 * g[4] + c5 * g[5],
        c6 * g[3] + c7 * g[4] + c8 * g[5],
    )
    cx, cy, cz = (
        c0 * g[6] + c1 * g[7] + c2 * g[8],
        c3 * g[6] + c4 * g[7] + c5 * g[8],
        c6 * g[6] + c7 * g[7] + c8 * g[8],
    )
    second = viscous_second * inverse
    lxx = w[0] * ax + w[3] * bx + w[6] * cx
    lyy = w[1] * ay + w[4] * by + w[7] * cy
    lzz = w[2] * az + w[5] * bz + w[8] * cz
    lxy = w[0] * ay + w[3] * by + w[6] * cy + (w[1] * ax + w[4] * bx + w[7] * cx)
    lxz = w[0] * az + w[3] * bz + w[6] * cz + (w[2] * ax + w[5] * bx + w[8] * cx)
    lyz = w[1] * az + w[4] * bz + w[7] * cz + (w[2] * ay + w[5] * by + w[8] * cy)
    exx = h0 + half * (h0 * h0 + h1 * h1 + h2 * h2)
    eyy = h4 + half * (h3 * h3 + h4 * h4 + h5 * h5)
    ezz = h8 + half * (h6 * h6 + h7 * h7 + h8 * h8)
    exy = (h1 + h3) + (h0 * h3 + h1 * h4 + h2 * h5)
    exz = (h2 + h6) + (h0 * h6 + h1 * h7 + h2 * h8)
    eyz = (h5 + h7) + (h3 * h6 + h4 * h7 + h5 * h8)
    flow = lxx + lyy + lzz
    drag = viscous_first * inverse * flow
    pressure = lame_first * (exx + eyy + ezz) + drag
    elastic, viscous = lame_second + lame_second, second + second
    taken = (
        drag * flow
        + viscous * (lxx * lxx + lyy * lyy + lzz * lzz)
        + second * (lxy * lxy + lxz * lxz + lyz * lyz)
    )
    txx = pressure + elastic * exx + viscous * lxx
    tyy = pressure + elastic * eyy + viscous * lyy
    tzz = pressure + elastic * ezz + viscous * lzz
    txy = lame_second * exy + second * lxy
    txz = lame_second * exz + second * lxz
    tyz = lame_second * eyz + second * lyz
    pulls = (
        txx * ax + txy * ay + txz * az, txy * ax + tyy * ay + tyz * az,
        txz * ax + tyz * ay + tzz * az, txx * bx + txy * by + txz * bz,
        txy * bx + tyy * by + tyz * bz, txz * bx + tyz * by + tzz * bz,
        txx * cx + txy * cy + txz * cz, txy * cx + tyy * cy + tyz * cz,
        txz * cx + tyz * cy + tzz * cz,
    )  # fmt: skip
    return pulls, jacobian, taken


def matrix_product(p: Nine, d: Nine) -> Any:
    """``P : Hdot``, the power of a stress [W/m^3] at a rate of the displacement gradient [1/s]."""
    return (
        p[0] * d[0] + p[1] * d[1] + p[2] * d[2] + p[3] * d[3] + p[4] * d[4] + p[5] * d[5]
        + p[6] * d[6] + p[7] * d[7] + p[8] * d[8]
    )  # fmt: skip


def viscous_small(h: Nine, d: Nine, viscous_first: Any, viscous_second: Any, half: Any) -> Nine:
    """``P = lambda_D tr(Hdot) I + mu_D (Hdot + Hdot^T)``: linear viscosity, as `stress_small`."""
    pressure = viscous_first * (d[0] + d[4] + d[8])
    twice = viscous_second + viscous_second
    xy, xz = viscous_second * (d[1] + d[3]), viscous_second * (d[2] + d[6])
    yz = viscous_second * (d[5] + d[7])
    return (
        pressure + twice * d[0], xy, xz, xy, pressure + twice * d[4], yz, xz, yz,
        pressure + twice * d[8],
    )  # fmt: skip
