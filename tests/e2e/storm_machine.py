"""A machine whose client, bridge and drivers each have a command port of their own, with relays between them that lose,
double and delay what passes."""

import os
import pathlib
import sys

from machine import Machine, wait_for

CLIENT_PORT, BRIDGE_PORT, DRIVER_PORT = 7668, 7768, 7868
SEED = int(os.environ.get("AXLECAST_SEED", "1"))
RELAY = pathlib.Path(os.environ["AXLECAST_SOURCE"]) / "tests" / "support" / "lossy_relay.py"


class StormMachine(Machine):
    """Files `client`, `bridge` and `drivers` of one machine, which differ in the command port only."""

    def write_files(self, text):
        """`text` has {lcm} where the mapping of that name goes."""
        for name, port in (("client", CLIENT_PORT), ("bridge", BRIDGE_PORT), ("drivers", DRIVER_PORT)):
            lcm = f'lcm: {{command_url: "udpm://239.255.76.67:{port}?ttl=0"}}'
            setattr(self, f"{name}_file", self.write(text.replace("{lcm}", lcm), f"{name}.yaml"))

    def start_relays(self, loss=0.3, duplication=0.1, delay_ms=30):
        for number, ports in enumerate(((CLIENT_PORT, BRIDGE_PORT), (BRIDGE_PORT, DRIVER_PORT))):
            name = f"relay-{number}"
            self.start(name, sys.executable, RELAY, *ports, "--loss", loss, "--duplication", duplication, "--delay-ms",
                       delay_ms, "--seed", SEED + number)
            wait_for(lambda name=name: "ready" in self.log(name), f"{name} listens")


def many_axes(count):
    """Encoders of which each is on a bus of its own, read slowly: their commands are what counts."""
    text = "machine: storm\n{lcm}\nbridge: {unsigned_commands: allow}\nbuses:\n"
    for axis in range(1, count + 1):
        text += f"""  b{axis}:
    family: tformat
    poll_hz: 20
    simulate:
      axis{axis}: {{start_deg: 100}}
    devices:
      axis{axis}: {{model: ts5669n127, unit: deg, publish_hz: 1, permit: not_required, timeout_us: 500000, eeprom_writable: [10]}}
"""
    return text
