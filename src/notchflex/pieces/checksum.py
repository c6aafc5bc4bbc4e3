"""A checksum in the footer of a Parquet file, of all its bytes: detects a damaged file.

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
    start_of_sum = bytes(data[start:]).rfind(_BEFORE)
    return None if start_of_sum < 0 else start + start_of_sum + len(_BEFORE)


def seal(data: memoryview) -> None:
    """Write the checksum over the `BLANK` that stands in its place.

    Args:
        data: The bytes of a file that was written with the metadata {KEY: BLANK}.
    """
    offset = _place(data)
    assert offset is not None
    data[offset : offset + 8] = b"%08x" % zlib.crc32(data)


def is_whole(data: memoryview) -> bool:
    """Tell whether the bytes of a file are those that were sealed; its checksum is blanked."""
    offset = _place(data)
    if offset is None:
        return False
    stored = bytes(data[offset : offset + 8])
    data[offset : offset + 8] = BLANK.encode()
    return stored == b"%08x" % zlib.crc32(data)
