"""Sound files spoilt at random: bytes, lengths and tokens, as damage and malice do it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

NUMBERS = (0, 1, 2, 7, 0x7F, 0x80, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0xFFFFFFFF, 10**8, 2**40, 2**63 - 1, 2**64 - 1)
TOKENS = (
    *(
        "!!python/object/apply:os.system ['true']",
        "!!binary aGk=",
        "&a [*a, *a]",
        "*a",
        "<<: *a",
        "? [a]",
        "---",
        "...",
    ),
    *(".nan", ".inf", "-.inf", "1e999", "-1", "0", "1e-320", "99999999999999999999", "0x10", "1_000", "nan", "inf"),
    *("../../etc/passwd", "/dev/zero", "/proc/self/mem", "..", "~", "null", "true", "[]", "{}", '""', "\x00", "\ufeff"),
    *(
        "<script>alert(1)</script>",
        "{expr: 'a' }",
        "{expr: '__import__(\"os\")'}",
        "{guess: .nan}",
        "{guess: 1, min: 2}",
    ),
    *("rigid", "lugre", "load.theta", "1e5 counts", "furlong", "'", '"', "\t", "\r\n", ",", ";", ":", "- ", "#"),
)


def spoilt(sources: Sequence[bytes], rng: np.random.Generator, text: bool) -> bytes:
    """Return one of the sound files after one to six changes."""
    content = bytearray(sources[int(rng.integers(len(sources)))])
    changes = (*_BYTES, *_TEXT) if text else _BYTES
    for _ in range(int(rng.integers(1, 7))):
        content = changes[int(rng.integers(len(changes)))](content, rng)
    return bytes(content)


def _place(content: bytearray, rng: np.random.Generator) -> int:
    """Return a place in a file; heads are hit as often as all the rest."""
    reach = min(len(content), 512) if rng.random() < 0.5 else len(content)
    return int(rng.integers(reach + 1))


def _flip(content: bytearray, rng: np.random.Generator) -> bytearray:
    at = _place(content, rng)
    if at < len(content):
        content[at] ^= 1 << int(rng.integers(8))
    return content


def _byte(content: bytearray, rng: np.random.Generator) -> bytearray:
    at = _place(content, rng)
    content[at : at + 1] = bytes([int(rng.integers(256))])
    return content


def _number(content: bytearray, rng: np.random.Generator) -> bytearray:
    """Write a number that lengths and counts do not expect, in one to eight bytes of either order."""
    at, size = _place(content, rng), int(rng.choice([1, 2, 4, 8]))
    value = NUMBERS[int(rng.integers(len(NUMBERS)))] % (1 << 8 * size)
    content[at : at + size] = value.to_bytes(size, "little" if rng.random() < 0.7 else "big")
    return content


def _cut(content: bytearray, rng: np.random.Generator) -> bytearray:
    at = _place(content, rng)
    del content[at : at + int(rng.integers(1, 200))]
    return content


def _shorten(content: bytearray, rng: np.random.Generator) -> bytearray:
    del content[_place(content, rng) :]
    return content


def _repeat(content: bytearray, rng: np.random.Generator) -> bytearray:
    at = _place(content, rng)
    piece = content[at : at + int(rng.integers(1, 200))]
    content[at:at] = piece * int(rng.integers(1, 20))
    return content


def _noise(content: bytearray, rng: np.random.Generator) -> bytearray:
    at = _place(content, rng)
    content[at:at] = rng.bytes(int(rng.integers(1, 64)))
    return content


def _token(content: bytearray, rng: np.random.Generator) -> bytearray:
    at = _place(content, rng)
    content[at:at] = TOKENS[int(rng.integers(len(TOKENS)))].encode()
    return content


def _value(content: bytearray, rng: np.random.Generator) -> bytearray:
    """Put a token in the place of what stands after a colon or a comma."""
    ends = [k for k, byte in enumerate(content) if byte in b":,"]
    if not ends:
        return content
    at = ends[int(rng.integers(len(ends)))] + 1
    stop = next((k for k in range(at, len(content)) if content[k] in b",}\n"), len(content))
    content[at:stop] = b" " + TOKENS[int(rng.integers(len(TOKENS)))].encode()
    return content


_BYTES = (_flip, _byte, _number, _cut, _shorten, _repeat, _noise)
_TEXT = (_token, _value, _value)
