"""A checksum in the footer of a Parquet file, of all its bytes: tells a file that was damaged.

Its place is found by the Thrift encoding of the footer: key, a field of text (0x18), its length.
"""

from __future__ import annotations

import zlib

KEY, BLANK = "notchflex-crc32", "0" * 8
_BEFORE = KEY.encode() + b"\x18\x08"


def _place(data: memoryview) -> int | None:
    """Return the place of the checksum, None where the file has none."""
    size = len(data)
    start = size - 8 - int.from_bytes(data[-8:-4], "little")
    if size < 12 or not 0 < start < size:
        return None
    found = bytes(data[start:]).rfind(_BEFORE)
    return None if found < 0 else start + found + len(_BEFORE)


def seal(data: memoryview) -> None:
    """Write the checksum over the `BLANK` that stands in its place.

    Args:
        data: The bytes of a file that was written with the metadata {KEY: BLANK}.
    """
    place = _place(data)
    assert place is not None
    data[place : place + 8] = b"%08x" % zlib.crc32(data)


def is_whole(data: memoryview) -> bool:
    """Tell whether the bytes of a file are those that were sealed; its checksum is blanked."""
    place = _place(data)
    if place is None:
        return False
    stored = bytes(data[place : place + 8])
    data[place : place + 8] = BLANK.encode()
    return stored == b"%08x" % zlib.crc32(data)
