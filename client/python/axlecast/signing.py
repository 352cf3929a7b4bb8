"""Keys and signatures of commands, permits and statuses: Ed25519 (RFC 8032) by libsodium. Needs the package python3-nacl.

A signature covers a text that names the kind of message, then the bytes: it is not valid for another kind.
"""

from __future__ import annotations

import hashlib
import os
import stat
from typing import NamedTuple

from nacl.bindings import crypto_core_ed25519_is_valid_point
from nacl.exceptions import BadSignatureError
from nacl.signing import SigningKey, VerifyKey

COMMAND = b"axlecast-command-1"
STATUS = b"axlecast-status-1"
PERMIT = b"axlecast-permit-1"

UNSIGNED = bytes(64)

_FILE_HEAD = "axlecast-key-1 "
_SIG_TO_END = 64 + 2 * 8  # bytes of command_status_t: sig and spare are its last members


class Keys(NamedTuple):
    """The own key of a client, and the key of the bridge whose statuses it accepts."""

    own: SigningKey | None = None
    """None: messages are sent unsigned."""
    bridge: VerifyKey | None = None
    """None: every status is accepted."""

    @classmethod
    def load(cls, key_file: str | os.PathLike | None, bridge_key: str) -> Keys:
        """Returns the key of a file (`axlecast keygen`) and the bridge's public key, 64 hex digits (`bridge: key: public` of the machine
        file). Raises ValueError or OSError if one of them cannot be used."""
        return cls(load_key(key_file) if key_file else None, parse_public_key(bridge_key) if bridge_key else None)


def load_key(path: str | os.PathLike) -> SigningKey:
    """Returns the secret key of a file. The file must belong to this user or root, and its mode must be 0600, 0400, 0640 or 0440.

    Raises OSError if it cannot be read, and ValueError if it is open to others or is not a key.
    """
    file = os.fspath(path)
    with open(file, "rb", opener=lambda name, flags: os.open(name, flags | os.O_NONBLOCK)) as opened:  # not blocked by a FIFO
        status = os.fstat(opened.fileno())
        if not stat.S_ISREG(status.st_mode):
            raise ValueError(f"{file} is not a regular file: name the file with the key")
        if status.st_uid not in (os.geteuid(), 0):
            raise ValueError(f"{file} belongs to user {status.st_uid}, who could read or change it: chown {os.geteuid()} '{file}'")
        if status.st_mode & (stat.S_IWGRP | stat.S_IXGRP | stat.S_IRWXO):
            raise ValueError(f"{file} is open to other users: chmod 640 '{file}'")
        text = opened.read(4_096).decode("ascii", "replace").rstrip("\r\n")
    seed = _from_hex(text.removeprefix(_FILE_HEAD)) if text.startswith(_FILE_HEAD) else None
    if seed is None:
        raise ValueError(f"{file} is not a key: `axlecast keygen FILE` writes one (docs/keys.md)")
    return SigningKey(seed)


def parse_public_key(text: str) -> VerifyKey:
    """Returns a public key of 64 hex digits. Raises ValueError if it is not one."""
    key = _from_hex(text)
    if key is None or not crypto_core_ed25519_is_valid_point(key):
        raise ValueError(f"the bridge's key '{text}' is not a public key of 64 hex digits")
    return VerifyKey(key)


def _from_hex(text: str) -> bytes | None:
    """Returns the 32 bytes of 64 hex digits, else None."""
    if len(text) != 64 or any(digit not in "0123456789abcdefABCDEF" for digit in text):
        return None
    return bytes.fromhex(text)


def sign(key: SigningKey | None, kind: bytes, data: bytes) -> bytes:
    """Returns the signature of 64 bytes; UNSIGNED without a key."""
    return UNSIGNED if key is None else key.sign(kind + data).signature


def digest(data: bytes) -> int:
    """Returns command_status_t.body_digest: the first 8 bytes, big-endian, of BLAKE2b-256."""
    return int.from_bytes(hashlib.blake2b(data, digest_size=32).digest()[:8], "big", signed=True)


def key_id(key: SigningKey | None) -> int:
    """Returns command_body_t.key_id: the digest of the public key, never 0; 0 without a key."""
    return 0 if key is None else digest(bytes(key.verify_key)) or 1


def is_signed_by(bridge: VerifyKey, encoded_status: bytes) -> bool:
    """Returns True if the bridge has signed this encoded command_status_t: its bytes with `sig` 0."""
    begin = len(encoded_status) - _SIG_TO_END
    if begin < 0:
        return False
    signature = encoded_status[begin:begin + 64]
    try:
        bridge.verify(STATUS + encoded_status[:begin] + UNSIGNED + encoded_status[begin + 64:], signature)
    except BadSignatureError:
        return False
    return True
