"""Tensions from the EXIF of photographs."""

from pathlib import Path

import numpy as np
import pytest

import notchflex as nf
from notchflex.photographs.reading import exif_texts, loads_of
from refusals import refused

ROBOT = nf.load_robot("pacheco2021-a")
image = pytest.importorskip("PIL.Image")


def written(file, comment=None, description=None):
    """Write a photograph with a comment (bytes) and a description in its EXIF."""
    tags = image.Exif()
    if description is not None:
        tags[0x010E] = description
    if comment is not None:
        tags.get_ifd(0x8769)[0x9286] = comment
    picture = np.zeros((80, 100, 3), np.uint8)
    image.fromarray(picture).save(file, exif=tags)
    return str(file)


@pytest.mark.parametrize("suffix", ["jpg", "png", "tif"])
def test_comment_goes_before_description(tmp_path, suffix):
    if suffix != "tif":  # Pillow writes no comment into TIFF files
        file = written(
            tmp_path / f"a.{suffix}", b"ASCII\0\0\0tension=1.2 N; pull=2", "tension = 3 N"
        )
        assert loads_of([file], ROBOT, None, None, exif=True) == {
            "pull": ("2",),
            "tendon_force_N": ("1.2",),
        }
    file = written(tmp_path / f"b.{suffix}", description="tension = 0,5")
    assert loads_of([file], ROBOT, None, None, exif=True) == {"tendon_force_N": ("0.5",)}


def test_comments_of_other_codes():
    little = b"II*\0" + (8).to_bytes(4, "little") + (1).to_bytes(2, "little")
    entry = (0x8769).to_bytes(2, "little") + (4).to_bytes(2, "little") + (1).to_bytes(4, "little")
    little += entry + (22).to_bytes(4, "little")
    text = b"UNICODE\0" + "tension=2 N".encode("utf-16-le")
    inner = (1).to_bytes(2, "little") + (0x9286).to_bytes(2, "little") + (7).to_bytes(2, "little")
    inner += len(text).to_bytes(4, "little") + (36).to_bytes(4, "little")
    assert exif_texts(little + inner + text) == ["tension=2 N"]


def test_exif_of_a_png_may_stand_behind_the_picture(tmp_path):
    file = Path(written(tmp_path / "a.png", description="Größe, tension=2 N".encode()))
    data = file.read_bytes()
    at = data.index(b"eXIf") - 4
    end = at + 12 + int.from_bytes(data[at : at + 4], "big")
    last = data.index(b"IEND") - 4
    moved = data[:at] + data[end:last] + data[at:end] + data[last:]
    assert exif_texts(data) == exif_texts(moved) == ["Größe, tension=2 N"]


def test_what_gives_no_tension(tmp_path):
    plain = written(tmp_path / "plain.jpg")
    for number, text in enumerate(
        ("a wrist", "tension=", "tension=-1 N", "tension=5 mN", "tension=1.2.3", "tension=2 kN",
         "tension=1e3 N", "extension=2 N")
    ):  # fmt: skip
        file = written(tmp_path / f"{number}.jpg", description=text)
        with refused("MISSING_VALUE"):
            loads_of([file], ROBOT, None, None, exif=True)
    with refused("MISSING_VALUE"):
        nf.measure(plain, ROBOT, exif=True)
    one = written(tmp_path / "one.jpg", description="tension=1 N, pull=1")
    other = written(tmp_path / "other.jpg", description="tension=2 N")
    with refused("MISSING_VALUE"):
        loads_of([one, other], ROBOT, None, None, exif=True)
    with refused("CONFLICT"):
        loads_of([one], ROBOT, None, "{tension}", exif=True)
    with refused("UNSUPPORTED"):
        loads_of([one], nf.load_robot("two-axis-wrist"), None, None, exif=True)
    with refused("FILE_NOT_FOUND"):
        loads_of([str(tmp_path / "none.jpg")], ROBOT, None, None, exif=True)


def test_damaged_files_have_no_texts_or_some(tmp_path):
    for suffix in ("jpg", "png", "tif"):
        file = tmp_path / f"a.{suffix}"
        written(file, b"ASCII\0\0\0tension=1.2 N", "a wrist")
        whole = file.read_bytes()
        for seed in range(200):
            random = np.random.default_rng(seed)
            data = bytearray(whole)
            for at in random.integers(0, min(len(data), 300), 1 + seed % 9):
                data[at] = int(random.integers(256))
            texts = exif_texts(bytes(data[: random.integers(1, len(data) + 1)]))
            assert all(isinstance(text, str) for text in texts)
