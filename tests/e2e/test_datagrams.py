"""Whatever datagrams come, from this host or another: no process ends, positions keep coming, memory stays bounded.
AXLECAST_DATAGRAMS sets how many are sent (tools/campaign), AXLECAST_NAMES how many names are invented after that,
AXLECAST_DATAGRAM_HZ how fast, AXLECAST_SEED which."""

import os
import pathlib
import socket
import subprocess
import sys
import time
import unittest

import hostile_datagrams
import lcm_log
from lcm_ear import LcmEar
from machine import BIN, LIMIT, Machine, wait_for
from mqtt_broker import MqttMachine
from signed_machine import SignedMachine

DATAGRAMS = int(os.environ.get("AXLECAST_DATAGRAMS", "20000"))
NAMES = int(os.environ.get("AXLECAST_NAMES", "60000"))
HZ = float(os.environ.get("AXLECAST_DATAGRAM_HZ", "10000"))
SEED = int(os.environ.get("AXLECAST_SEED", "1"))
JUDGES_RATE = "AXLECAST_DATAGRAMS" in os.environ  # a machine that runs tests beside each other has no steady rate
GROUP, OWN, OTHER = "239.255.76.67", "10.9.8.1", "10.9.8.2"
SENDER = pathlib.Path(__file__).with_name("hostile_datagrams.py")
CLIENT = BIN.parent / "campaign" / "patient_client"
MOST_GROWTH = 8 << 20  # bytes of a process
QUIET = 10 if JUDGES_RATE else 1  # s


def run(*words):
    subprocess.run(words, check=True)


class OtherHost:
    """A network namespace of its own at the other end of a cable. LCM's route leads to the cable, not to lo, so that what
    is sent there does reach this host."""

    def __init__(self):
        self.process = subprocess.Popen(["unshare", "--net", "sleep", "infinity"])
        namespace = f"/proc/{self.process.pid}/ns/net"
        wait_for(lambda: os.stat(namespace).st_ino != os.stat("/proc/self/ns/net").st_ino, "another namespace")
        run("ip", "link", "add", "eth7", "type", "veth", "peer", "name", "eth8", "netns", str(self.process.pid))
        run("ip", "addr", "add", f"{OWN}/24", "dev", "eth7")
        run("ip", "link", "set", "eth7", "up")
        run("ip", "route", "del", "224.0.0.0/4", "dev", "lo")
        run("ip", "route", "add", "224.0.0.0/4", "dev", "eth7")
        for line in (f"addr add {OTHER}/24 dev eth8", "link set eth8 up", "link set lo up",
                     "route add 224.0.0.0/4 dev eth8"):
            self.run("ip", *line.split())

    def within(self, *words):
        return ["nsenter", "--net", "--target", str(self.process.pid), *map(str, words)]

    def run(self, *words):
        run(*self.within(*words))

    def close(self):
        self.process.kill()
        self.process.wait()
        wait_for(lambda: subprocess.run(["ip", "link", "show", "eth7"], capture_output=True).returncode != 0,
                 "the cable gone with the other namespace")
        run("ip", "route", "add", "224.0.0.0/4", "dev", "lo")  # as in_namespace.sh has it


# Sends one short message to an address and port as if it came from SOURCE: IP and UDP headers by hand.
SPOOF = """
import socket, struct, sys
source, target, port, data = sys.argv[1], sys.argv[2], int(sys.argv[3]), bytes.fromhex(sys.argv[4])
raw = socket.socket(socket.AF_INET, socket.SOCK_RAW, socket.IPPROTO_RAW)
raw.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 1)
udp = struct.pack(">HHHH", 40000, port, 8 + len(data), 0) + data
ip = struct.pack(">BBHHHBBH4s4s", 0x45, 0, 20 + len(udp), 1, 0, 1, 17, 0, socket.inet_aton(source), socket.inet_aton(target))
raw.sendto(ip + udp, (target, 0))
"""


class Strangers(Machine):
    """What another host sends to a machine whose URL has ttl=0."""

    def setUp(self):
        super().setUp()
        self.other = OtherHost()
        self.addCleanup(self.other.close)

    def send_from_other_host(self, channel, address, source=OTHER, port=7667):
        datagram = hostile_datagrams.short(0, channel.encode(), bytes(8))
        self.other.run(sys.executable, "-c", SPOOF, source, address, port, datagram.hex())

    def recorded(self, ttl):
        """The channels that a recorder of a URL with this ttl recorded, and its summary."""
        log = self.folder / f"ttl{ttl}.lcm"
        recorder = self.start(f"record{ttl}", BIN / "axlecast", "record", log, "--json", "--url",
                              f"udpm://{GROUP}:7667?ttl={ttl}")
        watch = self.start(f"watch{ttl}", BIN / "axlecast", "watch", "--url", f"udpm://{GROUP}:7667?ttl={ttl}", "--json")
        wait_for(lambda: '"start"' in self.log(f"record{ttl}"), "the recorder to listen")
        for address, name in ((GROUP, "GROUP"), (OWN, "UNICAST")):
            self.send_from_other_host(name, address)
        for source in (OWN, "127.0.0.1"):  # addresses that are this host's
            self.send_from_other_host("SPOOFED", GROUP, source)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as own:
            own.sendto(hostile_datagrams.short(0, b"OWN_UNICAST", b""), (OWN, 7667))
            own.sendto(hostile_datagrams.short(1, b"OWN", b""), (GROUP, 7667))
        wait_for(lambda: b"OWN" in log.read_bytes() if log.exists() else False, "the host's own message in the log")
        recorder.send_signal(2)
        recorder.wait(LIMIT)
        watch.send_signal(2)
        watch.wait(LIMIT)
        channels = {channel for channel, _ in lcm_log.events(log)}
        return {name for name in channels if not name.startswith(("RECORDER", "ALARM", "AXLECAST"))} - {"LCM_SELF_TEST"}

    def test_only_what_this_host_sent_to_the_group_is_received_with_ttl_0(self):
        self.assertEqual(self.recorded(0), {"OWN"})
        self.assertIn("from other hosts refused, because the URL has ttl=0", self.log("watch0"))
        self.assertEqual(self.recorded(1), {"OWN", "GROUP"})


class Storm(SignedMachine, MqttMachine):
    def setUp(self):
        super().setUp()
        self.other = OtherHost()
        self.addCleanup(self.other.close)

    def run_machine(self):
        """Everything that receives: two drivers, bridge, page, MQTT, recorder, a watch and a program of the client
        library."""
        axes = "".join(f"""  b{axis}:
    family: tformat
    poll_hz: 500
    simulate:
      axis{axis}: {{speed_rpm: 60}}
    devices:
      axis{axis}: {{model: ts5669n127, unit: deg, publish_hz: 100, permit: not_required, timeout_us: 500000, eeprom_writable: [10]}}
""" for axis in (1, 2))
        self.config = self.write(f"machine: test\n{self.make_keys()}mqtt: {{host: 127.0.0.1}}\nbuses:\n{axes}")
        self.broker()
        self.data = self.watch(self.config, "--channel", "^(POSITION|DEVICE)/axis[12]$")
        for axis in (1, 2):
            self.simulator(self.config, f"b{axis}")
        self.parts = {f"driver of axis{axis}": self.driver(self.config, f"b{axis}") for axis in (1, 2)}
        self.parts["bridge"] = self.bridge(self.config)
        self.parts["web"] = self.start("web", BIN / "axlecast", "web", self.config, "--port", "0")
        self.parts["mqtt"] = self.mqtt("--json")
        # The recorder's queue grows while its writing thread gets no CPU: its limit must be far below MOST_GROWTH.
        self.parts["recorder"] = self.start("record", BIN / "axlecast", "record", self.folder / "a.lcm", "--config",
                                            self.config, "--buffer", "1MB", "--json")
        for axis in (1, 2):
            self.wait_online(self.data, f"axis{axis}")
        wait_for(lambda: "serving commands" in self.log("bridge"), lambda: self.log("bridge"))
        self.parts["client"] = self.start("client", CLIENT, self.config, "axis1")
        wait_for(lambda: "done" in self.log("client"), lambda: "a command's outcome: " + self.log("client"))
        self.wait_connected()
        wait_for(lambda: '"start"' in self.log("record") and "http" in self.log("web"), "the recorder and the page")
        self.parts["watch"] = self.data.process

    def write_genuine(self):
        ears = [LcmEar(port=port) for port in hostile_datagrams.PORTS]
        wait_for(lambda: all(len(ear.messages) > 300 for ear in ears[:1]) and ears[1].messages, "genuine messages")
        messages = {channel: (channel, data) for ear in ears for channel, data in list(ear.messages)}
        for ear in ears:
            ear.socket.sendto(b"", ("127.0.0.1", ear.socket.getsockname()[1]))  # ends it
            ear.thread.join()
            ear.socket.close()
        path = self.folder / "genuine"
        hostile_datagrams.write_genuine(path, messages.values())
        return path

    def resident(self):
        page = os.sysconf("SC_PAGESIZE")
        return {name: int(pathlib.Path(f"/proc/{process.pid}/statm").read_text().split()[1]) * page
                for name, process in self.parts.items() if process.poll() is None}

    def published(self, mark):
        """Of axis1, since a mark: share received of what was published, and the rate at which it was."""
        messages = self.data.of("POSITION/axis1", since=mark)
        boot = messages[0]["boot_id"]
        numbers = {message["seq"]: message["mono_ns"] for message in messages if message["boot_id"] == boot}
        first, last = min(numbers), max(numbers)
        return len(numbers) / (last - first + 1), (last - first) / (numbers[last] - numbers[first]) * 1e9

    def storm(self, genuine):
        """Half of it from this host, half from the other one, at once, then names from this one; the most memory that each
        process took."""
        most = self.resident()
        common = [sys.executable, SENDER, "all", genuine, DATAGRAMS // 2, HZ / 2]
        self.follow([[*common, SEED, 0, GROUP, "127.0.0.1", OWN], self.other.within(*common, SEED + 1, 1, GROUP, OWN)], most)
        self.follow([[sys.executable, SENDER, "new_name", genuine, NAMES, HZ, SEED, 0, GROUP]], most)
        return most

    def follow(self, commands, most):
        senders = [subprocess.Popen([str(word) for word in command], stdout=subprocess.PIPE, text=True)
                   for command in commands]
        while any(sender.poll() is None for sender in senders):
            for name, bytes_ in self.resident().items():
                most[name] = max(most.get(name, 0), bytes_)
            time.sleep(0.1)
        for sender in senders:
            self.assertEqual(sender.returncode, 0)
            print(sender.stdout.read().strip())
            sender.stdout.close()

    def test_a_storm_of_hostile_datagrams_ends_no_process_and_costs_no_position(self):
        self.run_machine()
        genuine = self.write_genuine()
        mark = self.data.mark()
        quiet_until = time.monotonic() + QUIET
        wait_for(lambda: time.monotonic() > quiet_until, "the rate of a quiet machine")
        _, quiet_hz = self.published(mark)
        before, mark, answered = self.resident(), self.data.mark(), self.log("client").count("done")
        most = self.storm(genuine)
        received, storm_hz = self.published(mark)
        last = self.data.last("POSITION/axis1")["seq"]
        wait_for(lambda: self.data.last("POSITION/axis1")["seq"] > last + 10, "positions after the storm")
        wait_for(lambda: self.log("client").count("done") > answered, "outcomes after the storm")
        growth = {name: most[name] - before[name] for name in before}
        for name, bytes_ in growth.items():
            print(f"{name}: {before[name] / 2**20:.1f} MB before, grew by {bytes_ / 2**20:.1f} MB")
        print(f"positions of axis1: {quiet_hz:.2f} Hz before, {storm_hz:.2f} Hz in the storm; {received:.2%} received; "
              f"{self.log('client').count('done') - answered} commands done in it")
        for name, process in self.parts.items():
            self.assertIsNone(process.poll(), f"{name} ended: {self.log(name)[-2000:]}")
        self.assertGreaterEqual(received, 0.99)
        if JUDGES_RATE:
            self.assertGreaterEqual(storm_hz, 0.99 * quiet_hz)
        self.assertEqual({name: bytes_ for name, bytes_ in growth.items() if bytes_ >= MOST_GROWTH}, {})


if __name__ == "__main__":
    unittest.main(verbosity=2)
