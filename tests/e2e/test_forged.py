"""A flood of messages that nobody with a key has sent: genuine ones again, shortened, with bits inverted, under foreign
signatures. Nothing of it acts. AXLECAST_FORGED sets how many (tools/campaign), AXLECAST_FORGED_HZ how fast,
AXLECAST_SEED which."""

import io
import os
import random
import select
import socket
import struct
import time
import unittest

import lcm_log
from machine import wait_for
from signed_machine import SignedMachine

FORGED = int(os.environ.get("AXLECAST_FORGED", "10000"))
HZ = float(os.environ.get("AXLECAST_FORGED_HZ", "2000"))
SEED = int(os.environ.get("AXLECAST_SEED", "1"))
GROUP, COMMAND_PORT = "239.255.76.67", 7668
DONE, REJECTED, UNVERIFIED = 0, 3, 7
COUNTERS = ("zeroings", "turn_resets", "error_clears", "eeprom_writes", "resets_counted", "resets_broken")
BURST = 20


def packed(message):
    buffer = io.BytesIO()
    message._encode_one(buffer)
    return message._get_packed_fingerprint() + buffer.getvalue()


def signed64(digits):
    """16 hex digits, as the CLI writes boot and key ids, as LCM's int64_t."""
    return struct.unpack(">q", bytes.fromhex(digits))[0]


class Forger:
    """Datagrams by channel, made from genuine ones."""

    def __init__(self, genuine):
        self.chance = random.Random(SEED)
        self.genuine = genuine  # datagrams
        self.types = lcm_log.generated_types()
        self.made = {"replayed": 0, "truncated": 0, "bits inverted": 0, "foreign signature": 0, "unsigned": 0}

    def make(self):
        kind = self.chance.choice(list(self.made))
        self.made[kind] += 1
        data = bytearray(self.chance.choice(self.genuine))
        if kind == "replayed":
            return bytes(data)
        if kind == "truncated":
            return bytes(data[:self.chance.randrange(len(data))])
        if kind == "bits inverted":
            begin = data.index(0, 8) + 1  # after the header and the channel's name
            for _ in range(self.chance.randint(1, 4)):
                data[self.chance.randrange(begin, len(data))] ^= 1 << self.chance.randrange(8)
            return bytes(data)
        return self.own(kind == "foreign signature")

    def own(self, signed):
        """A command for the bridge, or an order for the driver, whose form is right and whose time is good."""
        types, chance = self.types, self.chance
        sig = chance.randbytes(64) if signed else bytes(64)
        if chance.random() < 0.5:
            body = types.command_body_t()
            body.id, body.token = chance.randbytes(16), bytes(16)
            body.bridge_boot_id, body.issued_mono_ns = self.bridge_boot_id, time.monotonic_ns()
            body.valid_ms, body.expect_epoch = 60000, -1
            body.device = "axis1"
            body.key_id = chance.choice([self.key_id, 0, chance.getrandbits(63)])
            self.fill_operation(body)
            message, channel = types.command_t(), "COMMAND"
            message.body = packed(body)
            message.body_size = len(message.body)
        else:
            order = types.driver_order_t()
            order.id = chance.randbytes(16)
            order.bridge_boot_id, order.driver_boot_id = self.bridge_boot_id, self.driver_boot_id
            order.bridge_epoch = 1 << 40
            order.kind = types.driver_order_t.KIND_EXECUTE
            order.valid_ms, order.expect_epoch = 60000, -1
            order.device = "axis1"
            self.fill_operation(order)
            message, channel = types.driver_command_t(), "DRIVER_COMMAND/rs485-0"
            message.order = packed(order)
            message.order_size = len(message.order)
        message.sig = sig
        return struct.pack(">II", 0x4C433032, chance.getrandbits(31)) + channel.encode() + b"\0" + packed(message)

    def fill_operation(self, message):
        operation, arguments = self.chance.choice([("zero_single_turn", {}), ("clear_errors", {}),
                                                   ("eeprom_write", {"address": "10", "data": "5A"}),
                                                   ("reset_turns_and_errors", {})])
        message.operation = operation
        message.arguments = []
        for key, value in arguments.items():
            argument = self.types.argument_t()
            argument.key, argument.value = key, value
            message.arguments.append(argument)
        message.n_arguments = len(message.arguments)


class Forged(SignedMachine):
    def listen(self):
        listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.addCleanup(listener.close)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 8 << 20)
        listener.bind((GROUP, COMMAND_PORT))
        listener.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP,
                            socket.inet_aton(GROUP) + socket.inet_aton("127.0.0.1"))
        return listener

    @staticmethod
    def heard(listener):
        """What has come so far, of the channels that the flood takes up."""
        wanted = (b"COMMAND", b"DRIVER_COMMAND/", b"DRIVER_STATUS/", b"PERMIT/")
        while select.select([listener], [], [], 0)[0]:
            data = listener.recv(65536)
            channel = data[8:data.index(0, 8)]
            if channel.startswith(wanted) and channel != b"COMMAND_STATUS":
                yield data

    def record_genuine(self):
        """One of each operation that the flood tries again, with permits, and what the bridge and driver reported."""
        listener = self.listen()
        permits = self.start_permits("zero_single_turn", "reset_turns_and_errors")
        for words in (("eeprom", "write", "axis1", "10", "A1", "--yes"), ("clear-errors", "axis1", "--yes"),
                      ("zero", "axis1", "--yes")):
            code, outcome = self.permitted(*words)
            self.assertIn(code, (DONE, UNVERIFIED), outcome)  # there is no error whose clearing could be seen
        permits.terminate()
        permits.wait(20)
        genuine = list(self.heard(listener))
        listener.close()
        channels = {data[8:data.index(0, 8)].decode() for data in genuine}
        self.assertEqual(channels, {"COMMAND", "DRIVER_COMMAND/rs485-0", "DRIVER_STATUS/rs485-0", "PERMIT/axis1"})
        return genuine, outcome["boot_id"], outcome["driver_boot_id"]

    def counters(self):
        encoder = self.encoder()
        return {name: encoder[name] for name in COUNTERS}

    def rate_of_positions(self, work):
        """Positions a second that were published, by their numbers, while `work` continues; and how long that took."""
        def newest(since):
            return wait_for(lambda: self.data.of("POSITION/axis1", since=since)[-1:], "a position")[0]

        first = newest(self.data.mark())
        work()
        last = newest(self.data.mark())
        seconds = (last["mono_ns"] - first["mono_ns"]) / 1e9
        return (last["seq"] - first["seq"]) / seconds, seconds

    def flood(self, forger):
        begin = time.monotonic()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
            for number in range(FORGED):
                sender.sendto(forger.make(), (GROUP, COMMAND_PORT))
                if number % BURST == 0:
                    time.sleep(max(0, begin + number / HZ - time.monotonic()))  # the pace

    def test_nothing_of_a_flood_acts(self):
        self.run_signed_axis()
        genuine, bridge_boot_id, driver_boot_id = self.record_genuine()
        # What shows the positions shall not have to decode the flood.
        self.data.close()
        self.data = self.watch(self.config)
        forger = Forger(genuine)
        forger.bridge_boot_id, forger.driver_boot_id = signed64(bridge_boot_id), signed64(driver_boot_id)
        forger.key_id = signed64(self.key_id("local"))
        before = self.counters()
        calm, _ = self.rate_of_positions(lambda: time.sleep(2))  # the measure
        stormy, seconds = self.rate_of_positions(lambda: self.flood(forger))
        after = self.counters()
        self.assertEqual(after, before, "0 executed")
        wait_for(lambda: "foreign_commands" in self.alarms(self.data, "bridge"), "ALARM/bridge foreign_commands")
        self.assertEqual(self.command("zero", "axis1", "--yes")[1]["reason"], "no_permit", "no permit of the past counts")
        code, outcome = self.command("eeprom", "write", "axis1", "10", "A2", "--yes")
        self.assertEqual(code, DONE, outcome)
        self.assertEqual(self.encoder()["eeprom_writes"], before["eeprom_writes"] + 1)
        print(f"{FORGED} messages in {seconds:.1f} s, {FORGED / seconds:.0f} a second:",
              ", ".join(f"{count} {kind}" for kind, count in forger.made.items()))
        print(f"0 executed; positions {calm:.1f} a second before, {stormy:.1f} meanwhile: {100 * stormy / calm:.1f} %")


if __name__ == "__main__":
    unittest.main(verbosity=2)
