"""Compiled loops that turn the bytes of dumps into columns.

A number is read as Python's ``float()`` reads it, to the last bit: where its digits and
the power of ten are doubles themselves, one multiplication or division is correctly
rounded (Clinger 1990, "How to read floating point numbers accurately"); else the 128-bit
product of Lemire 2021, "Number parsing at a gigabyte per second" (doi:10.1002/spe.2984),
decides. What neither is sure of is left to the caller, who reads that frame with Python.
"""

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic
from numpy.typing import NDArray

_LOWEST_POWER, _HIGHEST_POWER = -342, 308
_EXACT_POWER = 22
_EXACT_DIGITS = np.uint64(2**53)
_MOST_DIGITS = 19


def _fives() -> NDArray[np.uint64]:
    """First 128 bits of 5**q for all powers of ten q of a double, (Q, 2): high, low.

    Those of -27 to -1, whose exact values have no end, are rounded up; all others down.
    """
    rows = []
    for power in range(_LOWEST_POWER, _HIGHEST_POWER + 1):
        five = 5 ** abs(power)
        bits = five.bit_length()
        if power < 0:
            scaled = (1 << (bits + 127)) // five + (power >= -27)
        else:
            scaled = five << (128 - bits) if bits <= 128 else five >> (bits - 128)
        rows.append((scaled >> 64, scaled & (2**64 - 1)))
    return np.array(rows, dtype=np.uint64)


_FIVES = _fives()
_TENS = np.array([10.0**power for power in range(_EXACT_POWER + 1)])

_U0, _U1, _U3, _U10 = (np.uint64(n) for n in (0, 1, 3, 10))
_U32, _U63, _U9 = np.uint64(32), np.uint64(63), np.uint64(9)
_LOW_HALF = np.uint64(2**32 - 1)
_UNSURE = np.uint64(2**9 - 1)
_HIDDEN = np.uint64(2**52)


def _instruction(result, argument, emit):
    """An operation on one number that numba has no function for."""

    @intrinsic
    def operation(_context, _number):
        def code(_context, builder, _signature, arguments):
            return emit(builder, arguments[0])

        return result(argument), code

    return operation


def _load(bits):
    """Emit a load from an address, which need not be aligned."""

    def emit(builder, address):
        loaded = builder.load(builder.inttoptr(address, ir.IntType(bits).as_pointer()))
        loaded.align = 1
        return loaded

    return emit


_DEFINED_AT_ZERO = ir.Constant(ir.IntType(1), 0)

_word = _instruction(types.uint64, types.uint64, _load(64))
_byte = _instruction(types.uint8, types.uint64, _load(8))
_bits_of = _instruction(
    types.uint64, types.float64, lambda builder, value: builder.bitcast(value, ir.IntType(64))
)
_double_of = _instruction(
    types.float64, types.uint64, lambda builder, bits: builder.bitcast(bits, ir.DoubleType())
)
_trailing_zeros = _instruction(
    types.uint64, types.uint64, lambda builder, word: builder.cttz(word, _DEFINED_AT_ZERO)
)
_leading_zeros = _instruction(
    types.uint64, types.uint64, lambda builder, word: builder.ctlz(word, _DEFINED_AT_ZERO)
)


@njit(nogil=True, cache=True, inline="always")
def _product(a, b):
    """The 128 bits of a product of two uint64: high, low."""
    a1, a0, b1, b0 = a >> _U32, a & _LOW_HALF, b >> _U32, b & _LOW_HALF
    low, cross1, cross2 = a0 * b0, a1 * b0, a0 * b1
    middle = (low >> _U32) + (cross1 & _LOW_HALF) + (cross2 & _LOW_HALF)
    high = a1 * b1 + (cross1 >> _U32) + (cross2 >> _U32) + (middle >> _U32)
    return high, (middle << _U32) | (low & _LOW_HALF)


@njit(nogil=True, cache=True)
def _bits(digits, power):
    """Bits of the double nearest to ``digits * 10**power``; 0 if this cannot tell.

    `digits` is a uint64 above zero. Subnormal and infinite results are among those
    it cannot tell.
    """
    if power < _LOWEST_POWER or power > _HIGHEST_POWER:
        return _U0
    shift = _leading_zeros(digits)
    scaled = digits << shift
    five = _FIVES[power - _LOWEST_POWER]
    high, low = _product(scaled, five[0])
    if high & _UNSURE == _UNSURE:
        more, _ = _product(scaled, five[1])
        low += more
        if more > low:
            high += _U1
    top = high >> _U63
    mantissa = high >> (top + _U9)
    exponent = ((217706 * power) >> 16) + 1086 + np.int64(top) - np.int64(shift)
    if exponent <= 0 or exponent >= 2046:
        return _U0
    halfway = low <= _U1 and mantissa & _U3 == _U1 and mantissa << (top + _U9) == high
    if halfway and -4 <= power <= 23:
        mantissa &= ~_U1
    mantissa = (mantissa + (mantissa & _U1)) >> _U1
    if mantissa >> np.uint64(53) != _U0:
        mantissa >>= _U1
        exponent += 1
    return (mantissa & ~_HIDDEN) | (np.uint64(exponent) << np.uint64(52))


_ZERO = np.uint64(0x30)
_ZEROS = np.uint64(0x3030303030303030)
_CARRY = np.uint64(0x7676767676767676)
_HIGHS = np.uint64(0x8080808080808080)
_PAIRS = np.uint64(0x000000FF000000FF)
_FIRST = np.uint64(100 + (1_000_000 << 32))
_SECOND = np.uint64(1 + (10_000 << 32))
_U8, _U16, _U18, _U64 = (np.uint64(n) for n in (8, 16, 18, 64))
_SCALES = np.array([10**count for count in range(9)], dtype=np.uint64)


@njit(nogil=True, cache=True, inline="always")
def _read_digits(at, digits):
    """Append the digits that begin at `at` to a uint64, which wraps: the digits, their end.

    Eight at a time: Lemire 2021, section 4.
    """
    while True:
        word = _word(at) ^ _ZEROS
        other = ((word + _CARRY) | word) & _HIGHS
        count = _trailing_zeros(other) >> _U3
        if count == _U0:
            return digits, at
        word <<= _U64 - (count << _U3)
        word = word * _U10 + (word >> _U8)
        word = ((word & _PAIRS) * _FIRST + ((word >> _U16) & _PAIRS) * _SECOND) >> _U32
        digits = digits * _SCALES[count] + word
        at += count
        if count < _U8:
            return digits, at


@njit(nogil=True, cache=True, inline="always")
def _read_number(at):
    """Read one decimal number.

    Parameters
    ----------
    at : uint64
        Address at which the number begins; the text goes on for at least 8 bytes after it.

    Returns
    -------
    digits : uint64
    power : int64
        Its size is ``digits * 10**power``.
    negative : bool
    end : uint64
        Where it ends; `at` if it is no number, or not one of the plain form.
    """
    start = at
    negative = _byte(at) == 45
    at += np.uint64(negative)
    begin = at
    if _byte(at + _U1) == 46:
        digits = np.uint64(_byte(at)) ^ _ZERO
        at += np.uint64(digits < _U10)
    else:
        digits, at = _read_digits(at, _U0)
    count = np.int64(at - begin)
    power = np.int64(0)
    if _byte(at) == 46:
        begin = at + _U1
        digits, at = _read_digits(begin, digits)
        power = -np.int64(at - begin)
        count -= power
    if count == 0 or count > _MOST_DIGITS:
        return digits, power, negative, start
    if _byte(at) == 101:
        at += _U1
        down = _byte(at) == 45
        if down or _byte(at) == 43:
            at += _U1
        begin = at
        given, at = _read_digits(begin, _U0)
        if at == begin or at - begin > _U3:
            return digits, power, negative, start
        power += -np.int64(given) if down else np.int64(given)
    return digits, power, negative, at


@njit(nogil=True, cache=True, inline="always")
def _double(digits, power):
    """Bits of the double nearest to ``digits * 10**power``, and whether this can tell."""
    if digits <= _EXACT_DIGITS and -_EXACT_POWER <= power <= _EXACT_POWER:
        value = np.float64(digits)
        value = value / _TENS[-power] if power < 0 else value * _TENS[power]
        return _bits_of(value), True
    found = _bits(digits, power) if digits != _U0 else _U0
    return found, found != _U0 or digits == _U0


@njit(nogil=True, cache=True, inline="always")
def _skip(at, literal):
    """Where a literal that should stand here ends; 0 if it does not stand here."""
    for byte in literal:
        if _byte(at) != byte:
            return _U0
        at += _U1
    return at


@njit(nogil=True, cache=True)
def _skip_lines(at, end, count):
    """Where the next lines end; 0 if the text ends before they do."""
    while count > 0 and at < end:
        if _byte(at) == 10:
            count -= 1
        at += _U1
    return at if count == 0 else _U0


@njit(nogil=True, cache=True, inline="always")
def _read_count(at):
    """Read a whole number that is a line: the number, the end of the line or 0."""
    number, after = _read_digits(at, _U0)
    plain = after > at and after - at <= _U18 and _byte(after) == 10
    return np.int64(number), after + _U1 if plain else _U0


@njit(nogil=True, cache=True)
def _text_head(at, end, step_line, count_line, box_line, names_line):
    """Read the lines before a frame's rows: step, number of rows, where the rows begin or 0."""
    step = rows = np.int64(0)
    at = _skip(at, step_line)
    if at != _U0:
        step, at = _read_count(at)
    if at != _U0:
        at = _skip(at, count_line)
    if at != _U0:
        rows, at = _read_count(at)
    if at != _U0:
        at = _skip(at, box_line)
    if at != _U0:
        at = _skip_lines(at, end, 4)
    if at != _U0:
        at = _skip(at, names_line)
    return step, rows, at


@njit(nogil=True, cache=True)
def _text_rows(at, rows, first, whole, cells):
    """Read the rows of a frame into `cells` from row `first` on: where they end, or 0."""
    width = len(whole)
    for row in range(first, first + rows):
        for column in range(width):
            digits, power, negative, after = _read_number(at)
            if after == at:
                return _U0
            if whole[column]:
                if power != 0 or digits > _EXACT_DIGITS:
                    return _U0
                bits = _U0 - digits if negative else digits
            else:
                bits, sure = _double(digits, power)
                if not sure:
                    return _U0
                bits |= np.uint64(negative) << _U63
            cells[column, row] = bits
            at = after
            if _byte(at) == 32:
                at += _U1
            elif column < width - 1:
                return _U0
        if _byte(at) != 10:
            return _U0
        at += _U1
    return at


@njit(nogil=True, cache=True)
def text_frames(at, size, lines, whole, cells, frames):
    """Read whole frames of a text dump, up to the first that is not of the plain form.

    Parameters
    ----------
    at : uint64
        Address of the text, which begins with a frame; zeros follow it, 64 of them at least.
    size : int64
        Its length in bytes.
    lines : tuple of four (L,) ndarrays of uint8
        The line above the step, that above the number of rows, the beginning of that
        above the box, and that which names the columns.
    whole : (M,) ndarray of bool
        The columns of whole numbers.
    cells : (M, R) ndarray of uint64
        Gets the bits of int64 in columns of whole numbers, else those of float64.
    frames : (F, 2) ndarray of int64
        Gets step and number of rows of each frame.

    Returns
    -------
    tuple of two int
        How many frames were read, and how many bytes they take.
    """
    start, end = at, at + np.uint64(size)
    done = row = 0
    while done < len(frames) and at < end:
        step, rows, after = _text_head(at, end, lines[0], lines[1], lines[2], lines[3])
        if after == _U0 or rows > cells.shape[1] - row:
            break
        after = _text_rows(after, rows, row, whole, cells)
        if after == _U0 or after > end or (after < end and _skip(after, lines[0]) == _U0):
            break
        frames[done, 0], frames[done, 1] = step, rows
        done += 1
        row += rows
        at = after
    return done, np.int64(at - start)


_STEP_WORD = np.frombuffer(b"ITEM: TI", dtype="<u8")[0]


@njit(nogil=True, cache=True)
def last_frame(at, size, step_line):
    """Offset of the last line, but the first, that is the one above a step; 0 if there is none."""
    for place in range(size - len(step_line), 0, -1):
        here = at + np.uint64(place)
        found = _word(here) == _STEP_WORD and _byte(here - _U1) == 10
        if found and _skip(here, step_line) != _U0:
            return place
    return 0


_HEAD_BYTES = 100
_INFINITE = np.uint64(0x7FF0000000000000)
_TILE = 8


@njit(nogil=True, cache=True, inline="always")
def _int32(at):
    return np.int64(np.int32(np.uint32(_word(at) & _LOW_HALF)))


@njit(nogil=True, cache=True)
def _binary_head(at, end, width):
    """Read the header of a frame: step, rows, ranks, where the ranks begin or 0."""
    bad = np.int64(0), np.int64(0), np.int64(0), _U0
    if end - at < np.uint64(_HEAD_BYTES):
        return bad
    step, rows = np.int64(_word(at)), np.int64(_word(at + _U8))
    tilted = _int32(at + _U16)
    if step < 0 or rows < 0 or tilted < 0 or tilted > 1:
        return bad
    at += np.uint64(_HEAD_BYTES - 8 + 24 * tilted)
    if end - at < _U8:
        return bad
    found, ranks = _int32(at), _int32(at + np.uint64(4))
    if found != width or ranks < 1 or rows > np.int64(end - at) // (8 * width):
        return bad
    return step, rows, ranks, at + _U8


@njit(nogil=True, cache=True)
def _rank_rows(at, end, width):
    """Number of rows that a rank wrote; -1 if they are not all there."""
    if end - at < np.uint64(4):
        return np.int64(-1)
    count = _int32(at)
    if count < 0 or count % width != 0 or 8 * count > np.int64(end - at) - 4:
        return np.int64(-1)
    return count // width


@njit(nogil=True, cache=True)
def _turn(at, rows, first, whole, cells):
    """Copy rows of doubles into columns; tell whether all are finite and whole if need be."""
    width = len(whole)
    line = np.uint64(8 * width)
    good = True
    for low in range(0, rows, _TILE):
        high = min(low + _TILE, rows)
        for column in range(width):
            place = at + np.uint64(8 * column)
            if whole[column]:
                for row in range(low, high):
                    value = _double_of(_word(place))
                    number = np.int64(value) if abs(value) <= 2.0**53 else np.int64(0)
                    good &= np.float64(number) == value
                    cells[column, first + row] = np.uint64(number)
                    place += line
            else:
                for row in range(low, high):
                    bits = _word(place)
                    good &= bits & _INFINITE != _INFINITE
                    cells[column, first + row] = bits
                    place += line
        at += line * np.uint64(_TILE)
    return good


@njit(nogil=True, cache=True)
def _binary_end(at, end, width):
    """Where a whole frame ends; 0 if it is not whole or not of the plain form."""
    _, rows, ranks, at = _binary_head(at, end, width)
    if at == _U0:
        return _U0
    for _ in range(ranks):
        count = _rank_rows(at, end, width)
        if count < 0:
            return _U0
        rows -= count
        at += np.uint64(4 + 8 * width * count)
    return at if rows == 0 else _U0


@njit(nogil=True, cache=True)
def whole_binary_frames(at, size, width):
    """How many bytes the whole frames take that bytes of a binary dump begin with."""
    start, end = at, at + np.uint64(size)
    while at < end:
        after = _binary_end(at, end, width)
        if after == _U0:
            break
        at = after
    return np.int64(at - start)


@njit(nogil=True, cache=True)
def binary_frames(at, size, whole, cells, frames):
    """Read whole frames of a binary dump, up to the first that is not of the plain form.

    Parameters and what it returns are those of `text_frames`.
    """
    start, end = at, at + np.uint64(size)
    width = len(whole)
    done = row = 0
    while done < len(frames) and at < end:
        after = _binary_end(at, end, width)
        if after == _U0:
            break
        step, rows, ranks, at_rank = _binary_head(at, end, width)
        if rows > cells.shape[1] - row:
            break
        first = row
        good = True
        for _ in range(ranks):
            count = _rank_rows(at_rank, end, width)
            good &= _turn(at_rank + np.uint64(4), count, first, whole, cells)
            first += count
            at_rank += np.uint64(4 + 8 * width * count)
        if not good:
            break
        frames[done, 0], frames[done, 1] = step, rows
        done += 1
        row += rows
        at = after
    return done, np.int64(at - start)
