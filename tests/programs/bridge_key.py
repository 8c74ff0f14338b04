"""The secret between a runtime and its bridge, for tests that are one of them; keys are kept in a folder of their own."""

import hmac
import os
import pathlib
import tempfile

_folder = tempfile.TemporaryDirectory()  # gone with the process
os.environ["XDG_RUNTIME_DIR"] = _folder.name
SEAL = 8  # bytes, at a datagram's end


def key_file(port):
    return pathlib.Path(_folder.name) / "palpate" / f"bridge-{port}.key"


def read_key(port):
    return bytes.fromhex(key_file(port).read_text())


def write_key(port, key):
    key_file(port).parent.mkdir(mode=0o700, exist_ok=True)
    key_file(port).write_text(key.hex() + "\n")


def seal(key, datagram):
    """Python's own HMAC in place of the last bytes."""
    return datagram[:-SEAL] + hmac.new(key, datagram[:-SEAL], "sha256").digest()[:SEAL]
