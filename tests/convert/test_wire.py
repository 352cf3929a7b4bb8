"""Wire captures: candump text read by can-utils and python-can, pcap and its T-format dissector by tshark."""

import unittest
from os import environ
from pathlib import Path

import can
from example_log import START, Converted, peer

SERIAL, CAN, SPI = 0, 1, 2
TRANSMIT, RECEIVE, STRAY, SILENT, CONFIRMED = 0, 1, 2, 3, 8
EXTENDED, REMOTE, ERROR = 0x80000000, 0x40000000, 0x20000000
DISSECTOR = Path(environ["AXLECAST_SOURCE"]) / "config/wireshark/axlecast_tformat.lua"

# ns, identifier with its flags, data: what was on the bus.
FRAMES = [(1_000, 0x123, bytes.fromhex("4726000000000000")), (2_501_000, 0x7FF, b""),
          (3_000_000, 0x1ABCDEF0 | EXTENDED, bytes.fromhex("DEADBEEF")), (4_000_000, 0x701 | REMOTE, b""),
          (5_000_000, 0x80 | ERROR, bytes.fromhex("0000010000000000")), (6_000_000, 0x5 | EXTENDED, b"\x01")]


def signed(number):
    return number - (1 << 32) if number & 0x80000000 else number


class CanCapture(Converted):
    def setUp(self):
        super().setUp()
        records = [(dt, CONFIRMED if i == 0 else RECEIVE, signed(number), data)
                   for i, (dt, number, data) in enumerate(FRAMES)]
        # An own frame is recorded when it is queued, and again when it was on the bus.
        records.insert(0, (500, TRANSMIT, 0x123, FRAMES[0][2]))
        self.log.wire("can0", CAN, START, 0, records)
        self.log.position("axis1", START + 10_000, 0, 1)

    def test_candump_text(self):
        text = self.convert("candump").read_text()
        self.assertEqual(text.splitlines()[:4], [
            "(1763740800.000001) can0 123#4726000000000000", "(1763740800.002501) can0 7FF#",
            "(1763740800.003000) can0 1ABCDEF0#DEADBEEF", "(1763740800.004000) can0 701#R"])

    def test_python_can_reads_it(self):
        out = self.convert("candump")
        path = out.rename(self.folder / "can.log")
        messages = list(can.LogReader(str(path)))
        self.assertEqual(len(messages), len(FRAMES))
        for (dt, number, data), message in zip(FRAMES, messages, strict=True):
            self.assertAlmostEqual(message.timestamp, START / 1e6 + dt / 1e9, places=5)
            self.assertEqual(message.is_extended_id, number & EXTENDED != 0 if not number & ERROR else True)
            self.assertEqual(message.is_remote_frame, number & REMOTE != 0)
            self.assertEqual(message.is_error_frame, number & ERROR != 0)
            if not number & ERROR:
                self.assertEqual((message.channel, message.arbitration_id, bytes(message.data)),
                                 ("can0", number & 0x1FFFFFFF, data))

    def test_can_utils_read_it(self):
        lines = [line.split() for line in peer("log2asc", "-I", self.convert("candump"), "can0").splitlines()]
        frames = {line[2]: line[5:] for line in lines if len(line) > 5 and line[3] in ("Rx", "Tx") and line[4] == "d"}
        self.assertEqual(frames["123"][1:9], "47 26 00 00 00 00 00 00".split())
        self.assertEqual(frames["1ABCDEF0x"][1:5], "DE AD BE EF".split())

    def test_tshark_reads_the_pcap(self):
        out = self.convert("pcap")
        lines = peer("tshark", "-r", out, "-T", "fields", "-E", "separator=|", "-e", "frame.time_epoch", "-e", "can.id",
                     "-e", "can.flags.xtd", "-e", "can.flags.rtr", "-e", "can.flags.err", "-e", "can.len", "-e",
                     "data.data").splitlines()
        self.assertEqual(len(lines), len(FRAMES))
        for (dt, number, data), line in zip(FRAMES, lines, strict=True):
            time, number_text, xtd, rtr, err, size, content = line.split("|")
            self.assertEqual(time, f"{START // 1_000_000}.{dt:09}")
            self.assertEqual((int(err), int(size)), (number >> 29 & 1, len(data)))
            if not number & ERROR:
                self.assertEqual((int(xtd), int(rtr)), (number >> 31 & 1, number >> 30 & 1))
                self.assertEqual((int(number_text), content), (number & 0x1FFFFFFF, data.hex()))


class SerialCapture(Converted):
    # drivers/tformat/golden: public captures, and the maker's document.
    EXCHANGES = [("02", "02 20 6E C3 58 D7"), ("1A", "1A 00 A5 A5 00 17 88 88 00 00 0D"), ("EA 4F A5", "EA 4F 55 F0"),
                 ("8A", "8A 00 34 12 00 AC"), ("1A", "1A 00 A5 A5 00 17 88 88 00 40 0D")]

    def setUp(self):
        super().setUp()
        records = []
        for i, (request, reply) in enumerate(self.EXCHANGES):
            records.append((100_000 * i, TRANSMIT, 0, bytes.fromhex(request)))
            records.append((100_000 * i + 50_123, RECEIVE, 0, bytes.fromhex(reply)))
        records += [(900_000, STRAY, -1, b"\x55"), (950_000, SILENT, -1, b""), (960_000, RECEIVE, 0, b"\x1A\x00", 2)]
        self.log.wire("rs485-0", SERIAL, START, 0, records)
        self.records = records

    def fields(self, *names):
        options = [word for name in names for word in ("-e", name)]
        text = peer("tshark", "-X", f"lua_script:{DISSECTOR}", "-r", self.convert("pcap", "--force"), "-T", "fields", "-E",
                    "separator=|", *options)
        return [line.split("|") for line in text.splitlines()]

    def test_header_and_times(self):
        found = self.fields("frame.time_epoch", "axlecast.kind", "axlecast.direction", "axlecast.id", "axlecast.bus",
                            "axlecast.duration_ns", "axlecast.timeout")
        expected = [[f"{START // 1_000_000}.{dt:09}", "0", str(direction), str(number), "rs485-0", "47000",
                     str(int(bool(flags)))] for dt, direction, number, _, *flags in self.records]
        self.assertEqual(found, expected)

    def test_requests_and_replies(self):
        found = self.fields("tformat.cf", "tformat.data_id", "tformat.sf", "tformat.single_turn", "tformat.multi_turn",
                            "tformat.enid", "tformat.almc", "tformat.address", "tformat.eeprom", "tformat.crc_bad")
        replies = [row for row, record in zip(found, self.records, strict=True) if record[1] == RECEIVE]
        self.assertEqual(replies[0][:4], ["0x02", "0x00", "0x20", "5817198"])
        self.assertEqual(replies[1], ["0x1a", "0x03", "0x00", "42405", "34952", "0x17", "0x00", "", "", "0"])
        self.assertEqual(replies[2][7:], ["79", "0x55", "0"])
        self.assertEqual((replies[3][1], replies[3][4]), ("0x01", "4660"))
        self.assertEqual(replies[4][9], "1")  # a damaged one: its CRC is wrong
        self.assertEqual(replies[5][1], "")   # cut
        self.assertEqual(found[4][7], "79")   # the request to read the EEPROM

    def test_filters_and_the_summary(self):
        out = self.convert("pcap")
        text = peer("tshark", "-X", f"lua_script:{DISSECTOR}", "-r", out, "-Y", "tformat.almc.battery_error == 1")
        self.assertEqual(len(text.splitlines()), 1)
        text = peer("tshark", "-X", f"lua_script:{DISSECTOR}", "-r", out)
        self.assertIn("ID 3 all reply: single-turn 42405, turns 34952", text)
        self.assertIn("T-format", text)

    def test_one_kind_in_a_file(self):
        self.log.wire("can0", CAN, START, 0, [(0, RECEIVE, 1, b"\x01")])
        said = self.axlecast("convert", "--to", "pcap", "-o", self.folder / "out.pcap", exit_code=1)
        self.assertIn("--channel", said)
        self.assertFalse((self.folder / "out.pcap").exists())
        self.convert("pcap", "--channel", "^WIRE/rs485-0$")

    def test_nothing_captured(self):
        self.log.events.clear()
        self.log.position("axis1", START, 0, 1)
        for kind in ("pcap", "candump"):
            said = self.axlecast("convert", "--to", kind, "-o", self.folder / "out", exit_code=1)
            self.assertIn("capture: true", said)


if __name__ == "__main__":
    unittest.main()
