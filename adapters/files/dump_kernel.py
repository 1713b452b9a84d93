"""Compiled reading of the numbers of a text dump: rows of decimal tokens to exact float64 bits."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

BLOCK_READ, TOKEN_UNUSUAL, ROW_SHORT, ROW_LONG = range(4)
"""What `read_rows` returns first; see there."""
_EXPONENT_LOWEST, _EXPONENT_HIGHEST = -342, 308
"""Decimal exponents beyond which a mantissa of 19 digits rounds to zero or to infinity."""
_FRACTION_FULL = 10**18
"""Below it one more decimal digit fits in 64 bits."""
_WHOLE_EXACT = 2**53
"""Below it every whole number is a float64."""
_TEN = 10.0 ** np.arange(23)
"""Powers of ten that are float64 without rounding."""


def tabulate_powers_of_five() -> NDArray[np.uint64]:
    """Leading 128 bits of 5^q, q from -342 to 308, as (high, low) words, shape (651, 2).

    Cut off, but rounded up for -27 <= q < 0, as the proof of Lemire (2021) wants them.
    """
    words = []
    for q in range(_EXPONENT_LOWEST, _EXPONENT_HIGHEST + 1):
        power = 5 ** abs(q)
        if q >= 0:
            leading = power << 128 >> power.bit_length()
        else:
            leading = (1 << 127 + power.bit_length()) // power + (q >= -27)
        words.append((leading >> 64, leading & 0xFFFFFFFFFFFFFFFF))
    return np.array(words, np.uint64)


_POWER = tabulate_powers_of_five()


@njit(cache=True)
def _multiply(a, b):  # type: ignore[no-untyped-def]
    """All 128 bits of the product of two uint64, as (high, low)."""
    low_half, half = np.uint64(0xFFFFFFFF), np.uint64(32)
    a_low, a_high, b_low, b_high = a & low_half, a >> half, b & low_half, b >> half
    cross = a_high * b_low + (a_low * b_low >> half)
    middle = a_low * b_high + (cross & low_half)
    return a_high * b_high + (cross >> half) + (middle >> half), a * b


@njit(cache=True)
def round_to_bits(w, q):  # type: ignore[no-untyped-def]
    """Bits of the float64 nearest to w 10^q, for uint64 w and int64 q; (bits, known).

    Algorithm of Eisel and Lemire: the product of w and the leading bits of 5^q decides the
    rounding.  ``known`` is False where it does not (very rarely), and for results that are
    subnormal or infinite.  Source: Lemire, Software: Practice and Experience 51 (2021) 1700.
    """
    zero, one = np.uint64(0), np.uint64(1)
    if w == zero:
        return zero, True
    if q < _EXPONENT_LOWEST or q > _EXPONENT_HIGHEST:
        return zero, False
    leading_zeros = np.int64(0)
    for shift in (32, 16, 8, 4, 2, 1):
        if w >> np.uint64(64 - shift) == zero:
            w = w << np.uint64(shift)
            leading_zeros += shift
    high, low = _multiply(w, _POWER[q - _EXPONENT_LOWEST, 0])
    if high & np.uint64(0x1FF) == np.uint64(0x1FF):
        carry, _ = _multiply(w, _POWER[q - _EXPONENT_LOWEST, 1])
        low = low + carry
        if low < carry:
            high = high + one
        if low == np.uint64(0xFFFFFFFFFFFFFFFF) and (q < -27 or q > 55):
            return zero, False
    upper = high >> np.uint64(63)
    mantissa = high >> (upper + np.uint64(9))
    exponent = (217706 * q >> 16) + 1086 + np.int64(upper) - leading_zeros
    if exponent <= 0:
        return zero, False
    halfway = low <= one and -4 <= q <= 23 and mantissa & np.uint64(3) == one
    if halfway and mantissa << (upper + np.uint64(9)) == high:
        mantissa = mantissa - one
    mantissa = (mantissa + (mantissa & one)) >> one
    if mantissa >> np.uint64(53) != zero:
        mantissa = mantissa >> one
        exponent += 1
    if exponent >= 2047:
        return zero, False
    fraction = mantissa & np.uint64(0xFFFFFFFFFFFFF)
    return fraction | np.uint64(exponent) << np.uint64(52), True


@njit(cache=True)
def read_rows(text, start, stop, values, row, column):  # type: ignore[no-untyped-def]
    """Read tokens of whole lines into a table, from its cell (row, column) on.

    ``text`` holds bytes, shape (b,) uint8; only text[start:stop] is read, which ends with a line
    end.  ``values`` is the table, shape (n, c) float64.  Returns (status, row, column, offset),
    the first cell not read and the offset of its token: BLOCK_READ at ``stop`` or when the table
    is full; TOKEN_UNUSUAL at a token for the caller to read (nan, a subnormal, no number at
    all); ROW_SHORT and ROW_LONG at a wrong number of tokens.
    """
    rows, columns = values.shape
    bits = values.view(np.uint64)
    zero, one, ten = np.uint64(0), np.uint64(1), np.uint64(10)
    full, exact = np.uint64(_FRACTION_FULL), np.uint64(_WHOLE_EXACT)
    i, stop = np.uint64(start), np.uint64(stop)  # unsigned: no test for indices below zero
    while i < stop and row < rows:
        character = text[i]
        if character == 32 or character == 9 or character == 13:
            i += one
            continue
        if character == 10:
            if column < columns:
                return ROW_SHORT, row, column, i
            row, column, i = row + 1, 0, i + one
            continue
        if column == columns:
            return ROW_LONG, row, column, i
        token = i
        negative = character == 45
        if negative or character == 43:
            i += one
        # The token is w 10^q; digits beyond the nineteenth only say whether there is a rest.
        w, q, rest, begin = zero, np.int64(0), False, i
        while np.uint8(text[i] - 48) < 10:
            if w < full:
                w = w * ten + np.uint64(text[i] - 48)
            else:
                q += 1
                rest = rest or text[i] != 48
            i += one
        digits = i - begin
        if text[i] == 46:
            i += one
            begin = i
            while np.uint8(text[i] - 48) < 10:
                if w < full:
                    w = w * ten + np.uint64(text[i] - 48)
                    q -= 1
                else:
                    rest = rest or text[i] != 48
                i += one
            digits += i - begin
        if text[i] == 101 or text[i] == 69:
            i += one
            exponent_negative = text[i] == 45
            if exponent_negative or text[i] == 43:
                i += one
            exponent, begin = np.int64(0), i
            while np.uint8(text[i] - 48) < 10:
                exponent = min(exponent * 10 + text[i] - 48, np.int64(1_000_000_000))
                i += one
            if i == begin:
                digits = zero
            q += -exponent if exponent_negative else exponent
        after = text[i]
        blank = after == 32 or after == 10 or after == 13 or after == 9
        if digits == zero or not blank:
            return TOKEN_UNUSUAL, row, column, token
        if w < exact and -22 <= q <= 0:  # w and 10^-q are exact, so that one division is too
            number = np.float64(w) / _TEN[-q]
            values[row, column] = -number if negative else number
        else:
            word, known = round_to_bits(w, q)
            if rest and known:
                word_above, known = round_to_bits(w + one, q)
                known = known and word_above == word
            if not known:
                return TOKEN_UNUSUAL, row, column, token
            bits[row, column] = word | np.uint64(negative) << np.uint64(63)
        column += 1
    return BLOCK_READ, row, column, i
