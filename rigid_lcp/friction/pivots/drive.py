"""Steps 2 to 4 of the paper's section 6 as kernels: drive a force, keep every contact consistent.

A drive increases one parameter s: the normal force of a new contact, then its tangential force, or
the share of a change of b (`rigid_lcp.friction.methods.pivoting` lives on that).  ``rate`` is what
the driven
quantity alone does to the accelerations for s = 1.  Between two events everything is linear in s.
"""

import numpy as np
from numba import njit

from rigid_lcp.arrays import Floats, Ints
from rigid_lcp.friction.pivots.updates import (
    BREAKING,
    NEW,
    SLIDING_DOWN,
    SLIDING_UP,
    STATIC,
    TURNING,
    Geometry,
    Reduced,
    add_reduced,
    couple_reduced,
    find_slide_sign,
    multiply_geometry,
    refresh_reduced,
    remove_reduced,
    scatter_column,
    solve_reduced,
)

DONE, RAY, CYCLED, SINGULAR, TOO_MANY = range(5)
"""How a drive ends: consistent; without bound; lists repeat; singular; too long."""
NO_EVENT, TOUCHES, PARTS, STICKS, SLIDES = range(5)
"""Events of step 3: none, (a), (b), (c), (d)."""
NORMAL, TANGENTIAL, OFFSET, PATH = range(4)
"""What is driven; along a path the share of an offset may fall as well."""
MOST_UPDATES = 200
"""Of an inverse [-] before it is computed afresh."""


@njit(cache=True)
def find_force_change(
    geometry: Geometry, reduced: Reduced, rate: Floats, force: Floats, acceleration: Floats
) -> None:
    """Eqs 30, 31: changes of all forces and accelerations for s = 1, into the last two."""
    force[:] = 0.0
    found = solve_reduced(reduced, rate)
    for i in range(len(found)):
        force[reduced.members[i]] = found[i]
    for c in range(len(reduced.kind)):
        sign = find_slide_sign(reduced.kind[c])
        if sign != 0.0 and geometry.tangent[c] >= 0:
            force[geometry.tangent[c]] = sign * geometry.mu[c] * force[geometry.normal[c]]
    acceleration[:] = rate
    multiply_geometry(geometry, force, acceleration)


@njit(cache=True)
def reach_zero(value: float, rate: float, ahead: float) -> float:
    """Step at which a quantity that may not become negative does; ``inf`` if it never does."""
    speed = rate * ahead
    return max(value, 0.0) / -speed if speed < 0.0 else np.inf


@njit(cache=True)
def find_first_event(
    geometry: Geometry, reduced: Reduced, f: Floats, a: Floats, df: Floats, da: Floats, ahead: float
) -> tuple[float, int, int, int]:
    """Step 3: the first event (a) to (d) along ``ahead`` (1 or -1): step, contact, event, list.

    At equal steps the contact of smallest index comes first.
    """
    first, who, event, to = np.inf, -1, NO_EVENT, NEW
    for c in range(len(reduced.kind)):
        kind, n, t, mu = reduced.kind[c], geometry.normal[c], geometry.tangent[c], geometry.mu[c]
        if kind == BREAKING:
            step = reach_zero(a[n], da[n], ahead)
            if step < first:
                first, who, event = step, c, TOUCHES
                to = choose_touching_list(
                    geometry, c, a[t] + step * ahead * da[t] if t >= 0 else 0.0
                )
        elif kind == STATIC:
            for sign in (1.0, -1.0):
                step = reach_zero(mu * f[n] - sign * f[t], mu * df[n] - sign * df[t], ahead)
                if step < first:
                    first, who, event = step, c, SLIDES
                    to = SLIDING_UP if sign > 0.0 else SLIDING_DOWN
        elif find_slide_sign(kind) != 0.0:
            step = reach_zero(f[n], df[n], ahead)
            if step < first:
                first, who, event, to = step, c, PARTS, BREAKING
            if t >= 0 and geometry.slip[c] == 0:
                sign = find_slide_sign(kind)
                step = reach_zero(-sign * a[t], -sign * da[t], ahead)
                if step < first:
                    first, who, event, to = step, c, STICKS, STATIC
    return first, who, event, to


@njit(cache=True)
def choose_touching_list(geometry: Geometry, contact: int, tangential: float) -> int:
    """List of a contact that becomes permanent, by its tangential acceleration (event a)."""
    if geometry.tangent[contact] < 0:
        return SLIDING_UP
    if geometry.slip[contact] != 0:
        return SLIDING_UP if geometry.slip[contact] > 0 else SLIDING_DOWN
    return SLIDING_UP if tangential <= 0.0 else SLIDING_DOWN


@njit(cache=True)
def move_contact(geometry: Geometry, reduced: Reduced, contact: int, to: int) -> bool:
    """Move a contact to another list, and the inverse with it; False where that is singular."""
    n, t, mu = geometry.normal[contact], geometry.tangent[contact], geometry.mu[contact]
    sign = find_slide_sign(reduced.kind[contact])
    fine = True
    if to == BREAKING:
        if reduced.place[n] >= 0:
            fine = remove_reduced(reduced, n)
    elif to == STATIC:
        fine = add_reduced(geometry, reduced, t)
        if fine and sign != 0.0:
            couple_reduced(geometry, reduced, contact, -sign * mu)
    elif to == TURNING:
        reduced.kind[contact] = TURNING
        fine = add_reduced(geometry, reduced, n)
    elif reduced.kind[contact] == TURNING:
        fine = add_reduced(geometry, reduced, t)
    elif reduced.kind[contact] != STATIC:
        reduced.kind[contact] = to
        fine = add_reduced(geometry, reduced, n)
    if fine and find_slide_sign(to) != 0.0 and t >= 0 and reduced.place[t] >= 0:
        couple_reduced(geometry, reduced, contact, find_slide_sign(to) * mu)
        fine = remove_reduced(reduced, t)
    reduced.kind[contact] = to
    return fine


@njit(cache=True)
def find_entering_rate(
    geometry: Geometry, df: Floats, da: Floats, contact: int, event: int, sign: float
) -> float:
    """How fast the quantity that an event has set free grows with s: it must not fall.

    ``sign``: of the sliding list that the contact has entered (d) or left (c).
    """
    n, t, mu = geometry.normal[contact], geometry.tangent[contact], geometry.mu[contact]
    if event == TOUCHES:
        return df[n]
    if event == PARTS:
        return da[n]
    if event == SLIDES:
        return -sign * da[t]
    return mu * df[n] - sign * df[t]


@njit(cache=True)
def settle_values(
    geometry: Geometry, reduced: Reduced, b: Floats, driven: Floats, f: Floats, a: Floats
) -> None:
    """Put f and a on their lists exactly: one step of refinement, ``a = b + driven + A f``."""
    a[:] = b + driven
    multiply_geometry(geometry, f, a)
    change, ignored = np.empty_like(f), np.empty_like(a)
    find_force_change(geometry, reduced, a, change, ignored)
    f += change
    for c in range(len(reduced.kind)):
        sign = find_slide_sign(reduced.kind[c])
        if sign != 0.0 and geometry.tangent[c] >= 0:
            f[geometry.tangent[c]] = sign * geometry.mu[c] * f[geometry.normal[c]]
    a[:] = b + driven
    multiply_geometry(geometry, f, a)


@njit(cache=True)
def find_driven_change(geometry: Geometry, c: int, what: int, sense: float, df: Floats) -> None:
    """Add the driven force itself to the changes ``df``: f_N with its friction, or f_T (step 2)."""
    n, t = geometry.normal[c], geometry.tangent[c]
    if what == NORMAL:
        df[n] = 1.0
        if t >= 0:
            df[t] = geometry.mu[c] * geometry.slip[c]
    elif what == TANGENTIAL:
        df[t] = sense


@njit(cache=True)
def find_driven_end(
    geometry: Geometry, contact: int, what: int, sense: float, ahead: float, left: float,
    f: Floats, a: Floats, df: Floats, da: Floats,
) -> tuple[float, int]:  # fmt: skip
    """Step after which the driven contact is consistent, and the list it is on then (step 2).

    A normal force until ``a_N = 0``, a tangential one until it sticks or slides, an offset until
    nothing is ``left`` of its share.
    """
    n, t, mu = geometry.normal[contact], geometry.tangent[contact], geometry.mu[contact]
    if what == NORMAL:
        return reach_zero(-a[n], -da[n], ahead), NEW
    if what == TANGENTIAL:
        still = reach_zero(-sense * a[t], -sense * da[t], ahead)
        slides = reach_zero(mu * f[n] - sense * f[t], mu * df[n] - sense * df[t], ahead)
        if still < slides:
            return still, STATIC
        return slides, SLIDING_UP if sense > 0.0 else SLIDING_DOWN
    return (left if ahead > 0.0 else np.inf), NEW


@njit(cache=True)
def is_repeat(seen: Ints, repeats: int, signature: int) -> bool:
    """Whether the lists, by their ``signature``, were the same before; it is noted in ``seen``.

    ``repeats``: events at this place, of which ``seen`` keeps the last.
    """
    for k in range(min(repeats, len(seen))):
        if seen[k] == signature:
            return True
    seen[repeats % len(seen)] = signature
    return False


@njit(cache=True)
def drive(
    geometry: Geometry, reduced: Reduced, b: Floats, f: Floats, a: Floats, rate: Floats,
    what: int, contact: int, limit: int, codes: Ints, count: Ints,
) -> tuple[int, int]:  # fmt: skip
    """Steps 2 to 4 for one driven quantity; returns how it ended and the contact where.

    ``what``: NORMAL or TANGENTIAL force of ``contact``, until it is consistent, or OFFSET, until
    s is 1 (b then holds its new value); PATH: after an event go on in the sense in which the
    contact that moved stays consistent, even if s falls.  ``codes`` (nc, 6) random numbers, one for
    a contact in a list; ``count`` (1,) counts events.
    """
    df, da = np.zeros(len(f)), np.zeros(len(f))
    seen = np.zeros(256, dtype=np.int64)
    signature, repeats, travelled, ahead, scale = 0, 0, 0.0, 1.0, 0.0
    who, event, to, sign = contact, int(NO_EVENT), NEW, 0.0
    sense = 1.0 if what != TANGENTIAL or a[geometry.tangent[contact]] < 0.0 else -1.0
    for turn in range(1, limit + 1):
        find_force_change(geometry, reduced, rate, df, da)
        find_driven_change(geometry, contact, what, sense, df)
        if what == PATH and event != NO_EVENT:
            ahead = 1.0 if find_entering_rate(geometry, df, da, who, event, sign) >= 0.0 else -1.0
        step, who, event, to = find_first_event(geometry, reduced, f, a, df, da, ahead)
        done, end = find_driven_end(
            geometry, contact, what, sense, ahead, 1.0 - travelled, f, a, df, da
        )  # fmt: skip
        if done == np.inf and step == np.inf:
            return RAY, contact
        last = done <= step
        if last:
            step = done
        travelled += ahead * step
        f += (ahead * step) * df
        a += (ahead * step) * da
        if what >= OFFSET:
            b += (ahead * step) * rate
        if last:
            if what == NORMAL:
                a[geometry.normal[contact]] = 0.0
            elif what == TANGENTIAL:
                return (DONE if move_contact(geometry, reduced, contact, end) else SINGULAR), 0
            return DONE, contact
        count[0] += 1
        signature ^= codes[who, reduced.kind[who]] ^ codes[who, to]
        scale = max(scale, abs(travelled))
        repeats = 0 if step > 1e-14 * scale else repeats
        if is_repeat(seen, repeats, signature):
            return CYCLED, who
        repeats += 1
        sign = find_slide_sign(to) if event == SLIDES else find_slide_sign(reduced.kind[who])
        if not move_contact(geometry, reduced, who, to):
            return SINGULAR, who
        snap_event(geometry, f, a, who, event, to)
        if turn % MOST_UPDATES == 0 and not refresh_reduced(geometry, reduced):
            return SINGULAR, who
    return TOO_MANY, contact


@njit(cache=True)
def snap_event(geometry: Geometry, f: Floats, a: Floats, who: int, event: int, to: int) -> None:
    """Set what an event has brought to its limit exactly there."""
    n, t = geometry.normal[who], geometry.tangent[who]
    if event == TOUCHES:
        a[n] = 0.0
    elif event == PARTS:
        f[n] = 0.0
        if t >= 0:
            f[t] = 0.0
    elif event == STICKS:
        a[t] = 0.0
    else:
        f[t] = find_slide_sign(to) * geometry.mu[who] * f[n]


@njit(cache=True)
def consider_contacts(
    geometry: Geometry, reduced: Reduced, b: Floats, f: Floats, a: Floats, order: Ints,
    limit: int, codes: Ints, count: Ints,
) -> tuple[int, int]:  # fmt: skip
    """Section 6, steps 1 to 4 for one contact after the other; how it ended, and where."""
    rate, nothing = np.zeros(len(b)), np.zeros(len(b))
    # as numbers: numba compiles what is called with constants once more for each of them
    normal, tangential = int(NORMAL), int(TANGENTIAL)
    for c in order:
        settle_values(geometry, reduced, b, nothing, f, a)
        n, t, slip = geometry.normal[c], geometry.tangent[c], geometry.slip[c]
        if a[n] >= 0.0:  # step 1
            reduced.kind[c] = BREAKING
            continue
        rate[:] = 0.0
        scatter_column(geometry, n, 1.0, rate)
        if slip != 0:
            scatter_column(geometry, t, slip * geometry.mu[c], rate)
        ended, where = drive(
            geometry, reduced, b, f, a, rate, normal, c, limit - count[0], codes, count
        )
        if ended != DONE:
            return ended, where
        if slip != 0 or t < 0:
            to = SLIDING_DOWN if slip < 0 else SLIDING_UP
            if not move_contact(geometry, reduced, c, to):
                return SINGULAR, c
            continue
        if not move_contact(geometry, reduced, c, int(TURNING)):
            return SINGULAR, c
        rate[:] = 0.0
        scatter_column(geometry, t, 1.0 if a[t] < 0.0 else -1.0, rate)
        ended, where = drive(
            geometry, reduced, b, f, a, rate, tangential, c, limit - count[0], codes, count
        )
        if ended != DONE:
            return ended, where
    settle_values(geometry, reduced, b, nothing, f, a)
    return DONE, -1
