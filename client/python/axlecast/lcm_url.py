"""URLs of LCM's UDP multicast: udpm://GROUP:PORT[?ttl=0..255][&recv_buf_size=BYTES][&interface=INTERFACE]. docs/configuration.md, `lcm`."""

from __future__ import annotations

import fcntl
import ipaddress
import pathlib
import re
import socket
import struct
import urllib.parse
from collections.abc import Iterator
from dataclasses import dataclass

_SIOCGIFADDR = 0x8915  # netdevice(7)

DEFAULT = "udpm://239.255.76.67:7667?ttl=0"  #: as in axlecast's machine file, if it has no `lcm: url`


@dataclass(frozen=True)
class LcmUrl:
    """Where messages are sent and received."""

    group: str  #: address of the multicast group, IPv4 or IPv6
    port: int
    ttl: int = 0  #: 0: this host only
    recv_buf_size: int = 0  #: bytes; 0: 32 MB, as far as the kernel permits (net.core.rmem_max)
    interface: str = ""  #: name, address or network (192.168.5.0/24) of an interface; "": the kernel's route selects one

    @property
    def is_ipv6(self) -> bool:
        return ":" in self.group


def parse(url: str) -> LcmUrl:
    """Raises ValueError with the cause if the URL is not valid."""
    scheme, separator, rest = url.partition("://")
    if not separator or scheme != "udpm":
        raise ValueError(f"{url}: only udpm:// can be received, for example {DEFAULT}")
    place, _, query = rest.partition("?")
    group, port = re.fullmatch(r"(\[.*\]|[^:]*):?(.*)", place, re.DOTALL).groups()
    group = group.strip("[]")
    try:
        is_group = ipaddress.ip_address(group).is_multicast
    except ValueError:
        is_group = False
    if not is_group:
        raise ValueError(f"{url}: '{group}' is no multicast group: 224.0.0.0 to 239.255.255.255, or ff00::/8 in brackets")
    options = dict(urllib.parse.parse_qsl(query, keep_blank_values=True))
    return LcmUrl(group=group, port=_number(url, "port", port, 1, 65_535), ttl=_number(url, "ttl", options.get("ttl", "0"), 0, 255),
                  recv_buf_size=_number(url, "recv_buf_size", options.get("recv_buf_size", "0"), 0, 1 << 30),
                  interface=options.get("interface", ""))


def _number(url: str, name: str, text: str, low: int, high: int) -> int:
    if not text.isdecimal() or not low <= int(text) <= high:
        raise ValueError(f"{url}: {name} must be {low} to {high}, and is '{text}'")
    return int(text)


def interface_index(interface: str) -> int:
    """Returns the index of an interface by its name, one of its addresses, or a network in which it has one; 0 for "".

    Raises OSError if this host has no such interface.
    """
    if not interface:
        return 0
    try:
        network = ipaddress.ip_network(interface, strict=False)
    except ValueError:
        return socket.if_nametoindex(interface)
    for index, address in _addresses():
        if address.version == network.version and address in network:
            return index
    raise OSError(f"this host has no interface with an address in {interface}")


def _addresses() -> Iterator[tuple[int, ipaddress.IPv4Address | ipaddress.IPv6Address]]:
    """The index and the addresses of each interface of this host; of IPv4 the first one."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
        for index, name in socket.if_nameindex():
            try:
                answer = fcntl.ioctl(asking.fileno(), _SIOCGIFADDR, struct.pack("256s", name.encode()))
            except OSError:
                continue  # it has none
            yield index, ipaddress.IPv4Address(answer[20:24])
    table = pathlib.Path("/proc/net/if_inet6")
    for line in table.read_text(encoding="ascii").splitlines() if table.exists() else ():
        address, index = line.split()[:2]
        yield int(index, 16), ipaddress.IPv6Address(bytes.fromhex(address))
