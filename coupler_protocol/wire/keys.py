"""Key files: who may pass the gate of a continuum (gate.py), and with which CURVE keys a link between machines is encrypted.

The key folder belongs to one user of the continuum's machine (`--keys`, COLLUVIUM_KEYS, or ~/.config/colluvium/keys):

    server.key              CURVE keys of the continuum
    clients/NAME.key        of a client: its public CURVE key, and the secret by which it passes the gate
    clients/NAME.revoked    the same, after `colluvium keys revoke NAME`
    local.key               the secret by which processes of the same user pass the gate of a loopback address

The file of a client, made once by `colluvium keys new NAME` and copied to the other machine, also has its secret CURVE key and
the public key of the continuum. All files are TOML, readable by their owner only (0600) in folders of their owner only (0700).
"""

import contextlib
import os
import re
import secrets
import stat
import time
import tomllib
from pathlib import Path
from typing import Any, NamedTuple

from coupler_protocol.exits import EnvironmentFailed

VARIABLE = "COLLUVIUM_KEYS"  # environment variable with the path of the key folder
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,39}")
SECRET = 32  # bytes of the secret of a gate
Z85 = 40  # characters of a CURVE key
OTHERS = 0o077  # permission bits of group and others
PATIENCE = 1.0  # [s] for another process to finish writing local.key


class ServerKeys(NamedTuple):
    """CURVE keys of the continuum, Z85 text."""

    public: bytes
    secret: bytes


class Client(NamedTuple):
    """A client as the continuum knows it: public CURVE key (Z85 text), secret of the gate (SECRET bytes)."""

    name: str
    public: bytes
    gate: bytes
    revoked: bool


class ClientKey(NamedTuple):
    """Keys of a client as the client has them: CURVE keys (Z85 text), secret of the gate (SECRET bytes)."""

    name: str
    server: bytes
    public: bytes
    secret: bytes
    gate: bytes


def folder_of(path: str | Path | None = None) -> Path:
    """The key folder: `path`, or that of the environment, or that of this user."""
    config = os.environ.get("XDG_CONFIG_HOME") or Path("~/.config").expanduser()
    return Path(path or os.environ.get(VARIABLE) or Path(config) / "colluvium" / "keys")


def private_folder(path: Path) -> Path:
    """Makes a folder of its owner only, if it does not exist; raises EnvironmentFailed if others can use it."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with contextlib.suppress(FileExistsError):
            path.mkdir(mode=0o700)
        about = path.lstat()
    except OSError as error:
        raise EnvironmentFailed(f"cannot make the key folder {path}: {error.strerror}; name another one in {VARIABLE}") from None
    if not stat.S_ISDIR(about.st_mode):
        raise EnvironmentFailed(f"{path} is not a folder: name a folder for keys with --keys or {VARIABLE}")
    _own(path, about, "700")
    return path


def _own(path: Path, about: os.stat_result, right: str) -> None:
    """Raises EnvironmentFailed for a file or folder of another user, or one that others can use."""
    if about.st_uid != os.geteuid():
        raise EnvironmentFailed(f"{path} belongs to another user (id {about.st_uid}): use key files of your own")
    if about.st_mode & OTHERS:
        raise EnvironmentFailed(
            f"{path} is open to other users (mode {stat.S_IMODE(about.st_mode):o}): chmod {right} {path}, "
            f"and make new keys if someone may have read it"
        )


def write_secret(path: Path, content: dict[str, str]) -> None:
    """Writes a new file that only its owner can read; raises FileExistsError, or EnvironmentFailed if it cannot be written.

    The mode belongs to the call that makes the file: at no time can others open it.
    """
    text = "".join(f'{key} = "{value}"\n' for key, value in content.items()).encode()
    try:
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, 0o600)
        with open(descriptor, "wb") as file:
            file.write(text)
            file.flush()
            os.fsync(descriptor)
        _sync_folder(path.parent)
    except FileExistsError:
        raise
    except OSError as error:
        raise EnvironmentFailed(f"cannot write {path}: {error.strerror}") from None


def _sync_folder(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def read_secret(path: Path, keys: dict[str, int]) -> dict[str, str]:
    """Content of a secret file; raises FileNotFoundError, or EnvironmentFailed if others can read it or it is damaged.

    keys: {key: length of its text}; 0 for any length.
    """
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    except FileNotFoundError:
        raise
    except OSError as error:
        raise EnvironmentFailed(f"cannot read {path}: {error.strerror}") from None
    with open(descriptor, "rb") as file:
        about = os.fstat(descriptor)
        if not stat.S_ISREG(about.st_mode):
            raise EnvironmentFailed(f"{path} is not a file")
        _own(path, about, "600")
        data = file.read(1 << 16)
    try:
        content = tomllib.loads(data.decode("ascii"))
        if all(isinstance(content[key], str) and len(content[key]) == (size or len(content[key])) for key, size in keys.items()):
            return content
    except (ValueError, KeyError):
        pass
    raise EnvironmentFailed(f"{path} is not a whole key file: copy it again, or make a new key with `colluvium keys new`")


def server_keys(folder: Path) -> ServerKeys | None:
    """CURVE keys of the continuum, None before the first `colluvium keys new`."""
    try:
        content = read_secret(folder / "server.key", {"public": Z85, "secret": Z85})
    except FileNotFoundError:
        return None
    return ServerKeys(content["public"].encode(), content["secret"].encode())


def new(folder: Path, name: str, path: Path) -> None:
    """Makes keys for a client: its entry in the key folder, and the file `path` that goes to its machine."""
    import zmq

    _checked_name(name)
    clients = private_folder(private_folder(folder) / "clients")
    known = next((client for client in clients_of(folder) if client.name == name), None)
    if known is not None:
        state = "was revoked" if known.revoked else "exists already"
        raise EnvironmentFailed(f"the key {name!r} {state}: choose another name")
    if os.path.lexists(path):
        raise EnvironmentFailed(f"{path} exists already: choose another --out")
    server = server_keys(folder)
    if server is None:
        server = ServerKeys(*zmq.curve_keypair())
        write_secret(folder / "server.key", {"public": server.public.decode(), "secret": server.secret.decode()})
    public, secret = (key.decode() for key in zmq.curve_keypair())
    gate = secrets.token_hex(SECRET)
    about = {"name": name, "public": public, "gate": gate, "made": time.strftime("%Y-%m-%d %H:%M:%S")}
    try:
        write_secret(path, {"name": name, "server": server.public.decode(), "public": public, "secret": secret, "gate": gate})
        write_secret(clients / f"{name}.key", about)
    except FileExistsError as error:
        raise EnvironmentFailed(f"{error.filename} exists already: choose another name") from None


def _checked_name(name: str) -> str:
    if not NAME.fullmatch(name):
        raise EnvironmentFailed(f"{name!r} is not a name of a key: use up to 40 of the characters A-Z a-z 0-9 _ . -")
    return name


def clients_of(folder: Path) -> list[Client]:
    """All clients of a key folder by name, the revoked ones also. Raises EnvironmentFailed for a file that cannot be trusted."""
    found = []
    for path in sorted((folder / "clients").glob("*")):
        if path.suffix in (".key", ".revoked"):
            with contextlib.suppress(FileNotFoundError):  # revoked just now
                content = read_secret(path, {"name": 0, "public": Z85, "gate": 2 * SECRET})
                found.append(Client(path.stem, content["public"].encode(), _bytes(path, content), path.suffix == ".revoked"))
    return found


def _bytes(path: Path, content: dict[str, str]) -> bytes:
    try:
        return bytes.fromhex(content["gate"])
    except ValueError:
        raise EnvironmentFailed(f"{path} is not a whole key file: its entry `gate` is not a secret") from None


def made(folder: Path, client: Client) -> str:
    """Date and time at which the key of a client was made."""
    path = folder / "clients" / f"{client.name}.{'revoked' if client.revoked else 'key'}"
    return read_secret(path, {}).get("made", "?")


def revoke(folder: Path, name: str) -> None:
    """Revokes the key of a client: the gate of a running continuum closes its connections within a second or two."""
    path = folder / "clients" / f"{_checked_name(name)}.key"
    if not path.exists():
        names = [client.name for client in clients_of(folder) if not client.revoked]
        raise EnvironmentFailed(f"there is no key {name!r} in {folder}; keys: {', '.join(names) or 'none'}")
    path.rename(path.with_name(f"{name}.revoked"))
    _sync_folder(path.parent)


def client_key(path: str | Path) -> ClientKey:
    """Keys of a client from its file; raises EnvironmentFailed if it does not exist, is damaged or can be read by others."""
    path = Path(path)
    sizes = {"name": 0, "server": Z85, "public": Z85, "secret": Z85, "gate": 2 * SECRET}
    try:
        content = read_secret(path, sizes)
    except FileNotFoundError:
        raise EnvironmentFailed(
            f"there is no key file {path}: make one with `colluvium keys new NAME` on the machine of the continuum and copy it"
        ) from None
    server, public, secret = (content[key].encode() for key in ("server", "public", "secret"))
    return ClientKey(content["name"], server, public, secret, _bytes(path, content))


def local_secret(folder: Path) -> bytes:
    """Secret of the gate for processes of this user on this machine, made when it is first needed."""
    path = private_folder(folder) / "local.key"
    with contextlib.suppress(FileExistsError):
        write_secret(path, {"gate": secrets.token_hex(SECRET)})
    until = time.monotonic() + PATIENCE
    while True:
        try:
            content: dict[str, Any] = read_secret(path, {"gate": 2 * SECRET})
            return _bytes(path, content)
        except EnvironmentFailed:  # another process may have made the file, but not have written it yet
            if time.monotonic() > until or path.stat().st_size:
                raise
            time.sleep(0.01)
