"""Compiled programs on disk: those of a user as machine code, those of a wheel as LLVM text.

The folder of a user is private, verified, and bounded in size. Machine code is run only from a
folder and files that belong to the user and that nobody else can write to; links are not followed.

A wheel carries text, so that the first call need not trace a program. It serves every processor and
every allowed LLVM; machine code is made when it is first needed. `packaging/hatch_build.py` records
the programs of typical calls when a wheel is built.
"""

from __future__ import annotations

import hashlib
import lzma
import os
import platform
import stat
import sys
import warnings
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from functools import cache, lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

PACKAGE = Path(__file__).parents[2]
"""Folder of notchflex."""

VARIABLE = "JAX_COMPILATION_CACHE_DIR"
"""Environment variable: the folder of stored programs; empty for none."""

MAX_BYTES = 256 * 2**20
"""Size beyond which the least recently used programs are removed."""

RECORD = "NOTCHFLEX_RECORD_PROGRAMS"
"""Environment variable: the folder to which the text of every program is written."""

SHIPPED = PACKAGE / "shipped_programs"
_PREFIX = "program-"
# Folders of notchflex that define programs, or what programs are made of. Programs depend on all of
# `lanewise`, too.
_COMPILED = {"robot", "mechanics", "loads", "solver", "results", "analysis"}
_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH
_NEW_FILE = os.O_WRONLY | os.O_CREAT | os.O_EXCL
_POSIX = hasattr(os, "geteuid") and os.open in os.supports_dir_fd


class Usage(NamedTuple):
    """Number and size of the programs of a folder."""

    programs: int
    size: int


def chosen_folder() -> Path | None:
    """Return the folder of the user's compiled code; None where it is not stored."""
    # `JAX_COMPILATION_CACHE_DIR` chooses another folder than the user's cache folder. Its value may
    # be the address of a store that JAX can write to and this library cannot.
    if VARIABLE in os.environ:
        chosen = os.environ[VARIABLE]
        return Path(chosen) if chosen and "://" not in chosen else None
    try:
        return _user_cache() / "notchflex"
    except RuntimeError:  # there is no home folder
        return None


def program_folder() -> Path | None:
    """Return the folder of programs for this kind of processor, created if needed and checked."""
    root = chosen_folder()
    return None if root is None else _checked(root / f"programs-{_machine()}")


def read(key: str) -> bytes | None:
    """Return the content stored under a key; None where none is complete and private."""
    root = program_folder()
    if root is None:
        return None
    try:
        with _opened(root) as folder, os.fdopen(folder.open(_name(key)), "rb") as file:
            if not _private(os.fstat(file.fileno()), stat.S_ISREG):
                return None
            content = file.read()
            with suppress(OSError):  # the time of the last use
                os.utime(file.fileno() if _POSIX else root / _name(key))
    except OSError:
        return None
    size = hashlib.sha256().digest_size
    digest, content = content[:size], content[size:]
    return content if hashlib.sha256(content).digest() == digest else None


def write(key: str, content: bytes) -> None:
    """Store content under a key atomically; do nothing where it cannot be stored."""
    root = program_folder()
    if root is None:
        return
    temporary = f".{_name(key)}.{os.getpid()}"
    with suppress(OSError), _opened(root) as folder:
        try:
            with os.fdopen(folder.open(temporary, _NEW_FILE), "wb") as file:
                file.write(hashlib.sha256(content).digest() + content)
            old, new, descriptor = (
                folder.path(temporary),
                folder.path(_name(key)),
                folder.descriptor,
            )
            os.replace(old, new, src_dir_fd=descriptor, dst_dir_fd=descriptor)
        finally:
            with suppress(OSError):
                os.unlink(folder.path(temporary), dir_fd=folder.descriptor)
        _shrink(root)


def usage() -> Usage:
    """Return number and size (bytes) of the stored programs for this processor."""
    sizes = [size for _, size, _ in _files(program_folder())]
    return Usage(len(sizes), sum(sizes))


def clear() -> Usage:
    """Remove all stored programs of this processor; return their number and size."""
    before = usage()
    for _, _, file in _files(program_folder()):
        with suppress(OSError):
            os.unlink(file)
    return before


def read_shipped(key: str) -> bytes | None:
    """Return the text recorded under a key; None where it is missing or damaged."""
    try:
        return lzma.decompress((SHIPPED / _shipped_name(key)).read_bytes())
    except (OSError, EOFError, lzma.LZMAError):
        return None


def recording() -> bool:
    """Return whether a wheel is being built."""
    return bool(os.environ.get(RECORD))


def record(key: str, content: bytes) -> None:
    """Record text under a key while a wheel is built."""
    if recording():
        path = Path(os.environ[RECORD]) / _shipped_name(key)
        path.write_bytes(lzma.compress(content, preset=2))


def _shipped_name(key: str) -> str:
    return hashlib.sha256(f"{code_digest()} {key}".encode()).hexdigest()[:32] + ".xz"


@cache
def code_digest() -> str:
    """Return a digest of the code that programs depend on."""
    compiler = find_spec("lanewise")
    assert compiler is not None
    assert compiler.submodule_search_locations is not None
    code = hashlib.sha256()
    for root in (os.fspath(PACKAGE), compiler.submodule_search_locations[0]):
        for folder, inner, files in os.walk(root):  # every process does this; pathlib takes longer
            if folder == os.fspath(PACKAGE):
                inner[:] = _COMPILED.intersection(inner)
            inner.sort()
            for name in sorted(name for name in files if name.endswith(".py")):
                path = os.path.join(folder, name)
                with open(path, "rb", buffering=0) as file:
                    code.update(os.path.relpath(path, root).encode() + b"\0" + file.read() + b"\0")
    return code.hexdigest()


@cache
def made_from() -> str:
    """Return a digest of code and versions, which programs depend on besides their arguments."""
    from importlib.metadata import version

    versions = [version(name) for name in ("jax", "jaxlib", "llvmlite")]
    settings = [os.environ.get("XLA_FLAGS", ""), os.cpu_count()]
    return hashlib.sha256(repr((code_digest(), versions, settings)).encode()).hexdigest()


def _name(key: str) -> str:
    return _PREFIX + hashlib.sha256(f"{made_from()} {key}".encode()).hexdigest()[:32]


@lru_cache(maxsize=16)
def _checked(folder: Path) -> Path | None:
    """Return a folder if it is private; it is checked again whenever it is opened."""
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        folder.mkdir(mode=0o700, exist_ok=True)
        with _opened(folder):
            return folder
    except PermissionError as error:
        if "others" in str(error):
            warnings.warn(str(error), stacklevel=2)
        return None
    except OSError:  # programs are compiled in every process
        return None


class _Opened(NamedTuple):
    """A checked folder, with its descriptor where the system has one."""

    folder: Path
    descriptor: int | None

    def path(self, name: str) -> str:
        """Return the path of a file, relative to the descriptor if there is one."""
        return os.fspath(self.folder / name) if self.descriptor is None else name

    def open(self, name: str, flags: int = os.O_RDONLY) -> int:
        """Open a file; links are not followed."""
        flags |= getattr(os, "O_BINARY", 0) | getattr(os, "O_NOFOLLOW", 0)
        return os.open(self.path(name), flags, 0o600, dir_fd=self.descriptor)


@contextmanager
def _opened(folder: Path) -> Generator[_Opened]:
    """Open a folder and check it through its descriptor, so that no other can replace it."""
    if not _POSIX:
        yield _Opened(folder, None)
        return
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        if not _private(os.fstat(descriptor), stat.S_ISDIR):
            raise PermissionError(
                f"compiled programs are not kept in {folder}: it belongs to others or others can "
                f"write to it; make it private (chmod go-w) or choose another with {VARIABLE}"
            )
        yield _Opened(folder, descriptor)
    finally:
        os.close(descriptor)


def _private(status: os.stat_result, is_kind: Callable[[int], bool]) -> bool:
    """Return whether a file or folder belongs to the user and nobody else can write to it."""
    is_owned = not _POSIX or (status.st_uid == os.geteuid() and not status.st_mode & _OTHERS_WRITE)
    return is_kind(status.st_mode) and is_owned


def _files(folder: Path | None) -> list[tuple[float, int, str]]:
    """Return time of the last use, size and path of every program; none without a folder."""
    files: list[tuple[float, int, str]] = []
    if folder is None:
        return files
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            if entry.is_file(follow_symlinks=False):  # those of JAX too
                about = entry.stat(follow_symlinks=False)
                files.append((about.st_mtime, about.st_size, entry.path))
    return files


def _shrink(folder: Path) -> None:
    """Remove the least recently used programs until the rest is small enough."""
    files = sorted(_files(folder))
    left = sum(size for _, size, _ in files)
    for _, size, file in files:
        if left <= MAX_BYTES:
            return
        with suppress(OSError):
            os.unlink(file)
            left -= size


def _user_cache() -> Path:
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    chosen = Path(os.environ.get("XDG_CACHE_HOME", ""))
    return chosen if chosen.is_absolute() else Path.home() / ".cache"  # relative ones are ignored


@cache
def _machine() -> str:
    """Return a short name of the kind of processor, its instruction sets included."""
    # A home folder may be shared by machines of different kinds.
    facts = [platform.machine(), platform.processor()]
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
        lines = text.splitlines()
        facts += [line for line in lines if line.startswith(("flags", "model name"))][:2]
    except OSError:
        pass
    return hashlib.sha256("\n".join(facts).encode()).hexdigest()[:12]
