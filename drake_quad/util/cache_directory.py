"""Where the package keeps what it has made and can make again: robots' URDFs, compiled kernels."""

import grp
import os
import pwd
import stat
import tempfile
from pathlib import Path

import platformdirs

CACHE_VARIABLE = "DRAKE_QUAD_CACHE"
OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH


def cache_directory() -> Path:
    """The directory that the user names in DRAKE_QUAD_CACHE, or the user's cache directory.

    A user without a home directory has none; a directory below the system's place for temporary
    files serves instead.
    """
    own = os.environ.get(CACHE_VARIABLE)
    if own:
        return Path(own).absolute()
    usual = Path(platformdirs.user_cache_dir("drake_quad"))
    if usual.is_absolute() and _can_be_made(usual):
        return usual
    return Path(tempfile.gettempdir()) / f"drake_quad-{os.getuid()}"


def private_directory(path: Path) -> bool:
    """Makes a directory for this user alone; whether there is one that nobody else can write to.

    What is loaded from a cache is executed. So the directory has to be this user's own, and no
    other user may write to it, or to a directory above it, by which it could be replaced.

    Args:
        path: The directory, absolute.

    Returns:
        False if it cannot be made or written to, or if it cannot be trusted.
    """
    try:
        path.mkdir(mode=0o700, parents=True, exist_ok=True)
        real = path.resolve(strict=True)
        own = real.stat()
        if own.st_uid != os.getuid() or own.st_mode & OTHERS_WRITE or not os.access(real, os.W_OK):
            return False
        return all(_safe_above(folder.stat()) for folder in real.parents)
    except OSError:
        return False


def _can_be_made(path: Path) -> bool:
    """Whether the directory is there and can be written to, or can be made."""
    there = next(folder for folder in (path, *path.parents) if folder.exists())
    return there.is_dir() and os.access(there, os.W_OK | os.X_OK)


def _safe_above(folder: os.stat_result) -> bool:
    """Whether other users cannot replace what lies in a folder of these attributes."""
    if folder.st_uid not in (0, os.getuid()):
        return False
    if folder.st_mode & stat.S_ISVTX:  # as /tmp: nobody but its owner may move an entry
        return True
    if folder.st_mode & stat.S_IWOTH:
        return False
    return not folder.st_mode & stat.S_IWGRP or _has_group_alone(folder.st_gid)


def _has_group_alone(gid: int) -> bool:
    """Whether the group is this user's private one, as many distributions give to every user."""
    try:
        user, members = pwd.getpwuid(os.getuid()), grp.getgrgid(gid).gr_mem
    except KeyError:
        return False
    return gid == user.pw_gid and set(members) <= {user.pw_name}
