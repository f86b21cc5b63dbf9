"""A page within a page, packed small: what is in base64 is packed as the bytes that it stands for.

Meshcat's recordings are numbers in base64, of which gzip makes little, and of the numbers much.
The report's script (`report.html`) unpacks what is made here as `unpack` does.
"""

import base64
import binascii
import gzip
import json
import re

import numpy as np

# Meshcat has its recording in data URLs; short ones are left as they are.
_BASE64 = re.compile(r"(?<=;base64,)[A-Za-z0-9+/]{400,}={0,2}")
# Of a recording in MessagePack: a keyframe's three or four numbers, each of 8 bytes after \xcb.
_RECORDING = b"\x83\xa4type\xadset_animation"
_KEYFRAME = re.compile(rb"(?<=\xa5value[\x93\x94])(?:\xcb.{8}){3,4}", re.DOTALL)
FINEST = 2.0**-20  # [m], and of a unit quaternion: a thousandth of a millimetre


def round_recording(page: str) -> str:
    """The page with the numbers of its recording rounded to whole FINEST.

    Nobody sees so little move; and what is rounded ends in zeros, of which packing makes nothing.
    """

    def keyframe(found: re.Match[bytes]) -> bytes:
        cells = np.frombuffer(found[0], dtype=[("mark", "S1"), ("value", ">f8")]).copy()
        cells["value"] = np.round(cells["value"] / FINEST) * FINEST
        return cells.tobytes()

    def recording(found: re.Match[str]) -> str:
        try:
            raw = base64.b64decode(found[0])
        except binascii.Error:
            return found[0]
        if not raw.startswith(_RECORDING):
            return found[0]
        return base64.b64encode(_KEYFRAME.sub(keyframe, raw)).decode()

    return _BASE64.sub(recording, page)


def pack(page: str) -> str:
    """The page in base64 of gzip: the lengths of its pieces as JSON, a line, then the pieces.

    Pieces are text and bytes in turn, text first; bytes are what base64 in the page stands for.
    """
    pieces, end = [], 0
    for found in _BASE64.finditer(page):
        try:
            raw = base64.b64decode(found[0])
        except binascii.Error:
            continue
        if base64.b64encode(raw).decode() != found[0]:  # it would not come back as it was
            continue
        pieces += [page[end : found.start()].encode(), raw]
        end = found.end()
    pieces.append(page[end:].encode())
    head = json.dumps([len(piece) for piece in pieces]).encode() + b"\n"
    packed = gzip.compress(head + b"".join(pieces), compresslevel=6, mtime=0)
    return base64.b64encode(packed).decode()


def unpack(packed: str) -> str:
    """The page that `pack` was given."""
    head, _, rest = gzip.decompress(base64.b64decode(packed)).partition(b"\n")
    text, at = [], 0
    for k, length in enumerate(json.loads(head)):
        piece = rest[at : at + length]
        text.append((base64.b64encode(piece) if k % 2 else piece).decode())
        at += length
    return "".join(text)
