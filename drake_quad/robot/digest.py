"""The digest that tells robots' files apart."""

import hashlib
from dataclasses import fields, replace

from drake_quad.robot.importer.robot_source import find_source
from drake_quad.robot.importer.sources import files_named_in
from drake_quad.util.files import MOST_TEXT, read_given

# [bytes] A greater file is a mesh, whose name and size stand for it: some have tens of megabytes.
MOST_READ = 1 << 20


def robot_digest(model: str) -> str:
    """Digest of a robot's file, the files that it names and its overrides, wherever they lie.

    Args:
        model: A file, a robot's name, or a `.robot.yaml` that names one.

    Raises:
        InputError: If it is not there.
    """
    given = find_source(model)
    digest = hashlib.sha256(read_given(given.found.path, most=MOST_TEXT))
    said = replace(given.overrides, model="")
    for one in fields(said):  # a field that later versions add changes no robot that lacks it
        value = getattr(said, one.name)
        if value not in (None, "", {}):
            digest.update(f"{one.name}={value!r};".encode())
    for path in files_named_in(given.found.path):
        size = path.stat().st_size
        digest.update(f"{path.name} {size}".encode())
        if size <= MOST_READ:
            digest.update(read_given(path, most=MOST_READ))
    return digest.hexdigest()[:12]
