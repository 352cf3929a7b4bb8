"""Debian's own kernel for the guest: its package is fetched once and unpacked, never installed."""

import lzma
import pathlib
import re
import shutil
import subprocess
import tempfile

# What the guest needs beyond what Debian builds in; modprobe adds what these need themselves.
MODULES = ["virtio_pci", "9pnet_virtio", "9p", "overlay",  # the host's files
           "virtio_net",                                   # tests/time_guests
           "kvaser_pci", "slcan", "can_raw", "vcan",       # controllers, and the sockets on them
           "cuse",                                         # character devices from user space
           "xhci_pci", "ftdi_sio", "autofs4"]              # a serial adapter; what systemd asks for


class Unusable(Exception):
    """The guest cannot be made; the text names cause and remedy."""


def run(*command, cwd=None):
    try:
        words = [str(word) for word in command]
        return subprocess.run(words, cwd=cwd, check=True, capture_output=True, text=True).stdout
    except FileNotFoundError:
        raise Unusable(f"{command[0]} is missing: install the packages_vm of tools/packages.sh") from None
    except subprocess.CalledProcessError as error:
        raise Unusable(f"{' '.join(map(str, command))}: {(error.stderr or error.stdout).strip()}") from None


def package():
    """The one package that linux-image-amd64 depends on. A wildcard would bring gigabytes of debug symbols."""
    names = re.findall(r"Depends: (linux-image-\S+-amd64)$", run("apt-cache", "depends", "linux-image-amd64"), re.M)
    if len(names) != 1:
        raise Unusable(f"linux-image-amd64 should depend on one package, not on {names}: apt-get update")
    return names[0]


def download(cache):
    """The package's file, fetched when it is not there yet."""
    debs = sorted(cache.glob("linux-image-*.deb"))
    if debs:
        return debs[-1]
    with tempfile.TemporaryDirectory(dir=cache) as folder:
        try:
            run("apt-get", "download", package(), cwd=folder)
        except Unusable:  # lists that are missing, or older than the archive
            run("apt-get", "update", "-q")
            run("apt-get", "download", package(), cwd=folder)
        deb, = pathlib.Path(folder).glob("*.deb")
        return deb.rename(cache / deb.name)


def decompress(vmlinuz):
    """The kernel itself. The guest would take 2.5 s to unpack it, and begins at once in this form (PVH)."""
    image = vmlinuz.read_bytes()
    start = image.find(b"\xfd7zXZ\0")
    kernel = lzma.LZMADecompressor().decompress(image[start:]) if start >= 0 else b""
    if not kernel.startswith(b"\x7fELF"):
        raise Unusable(f"{vmlinuz.name} holds no kernel compressed by xz: see decompress in tests/vm/kernel.py")
    return kernel


def in_order(root, version):
    """The files of MODULES and of all that they need, in the order in which they can be loaded."""
    run("/sbin/depmod", "-b", root, version)
    found = []
    for module in MODULES:
        for line in run("/sbin/modprobe", "-d", root, "-S", version, "--show-depends", module).splitlines():
            action, *path = line.split()
            if action == "insmod" and path[0] not in found:
                found.append(path[0])
    return found


def prepare(cache):
    """(the kernel, its modules in order), made in `cache` from the package unless they are there."""
    cache.mkdir(parents=True, exist_ok=True)
    deb = download(cache)
    ready = cache / "kernel"
    made_of = ready / "made_of"
    recipe = f"{deb.name}\n{' '.join(MODULES)}\n"
    if not (made_of.exists() and made_of.read_text() == recipe):
        shutil.rmtree(ready, ignore_errors=True)
        ready.mkdir()
        with tempfile.TemporaryDirectory(dir=cache) as folder:
            run("dpkg", "-x", deb, folder)
            vmlinuz, = pathlib.Path(folder, "boot").glob("vmlinuz-*")
            (ready / "vmlinux").write_bytes(decompress(vmlinuz))
            for place, module in enumerate(in_order(folder, vmlinuz.name.removeprefix("vmlinuz-"))):
                shutil.copy(module, ready / f"{place:02}-{pathlib.Path(module).name}")
        made_of.write_text(recipe)
    return ready / "vmlinux", sorted(ready.glob("*.ko"))
