"""`axlecast decode` against readers that were written from the makers' documents: the same frames, good and damaged. Ours must accept what
they accept, with the same content, and refuse what they refuse."""

import math
import pathlib
import tempfile
import unittest

import can
from compared import CASES, Compared, decode, flipped, made, resized

import biss
import saa_can
import saa_serial
import ssi
import tformat
import tformat_reader


class Decoded(Compared):
    def compare(self, family, settings, cases, *options, bits=None):
        """Cases: (text of a frame, what a reader made of it or None). `bits`: of the angle."""
        for (text, expected), ours in zip(cases, decode(family, settings, [text for text, _ in cases], *options), strict=True):
            where = (family, settings, text, expected, ours)
            if expected is None:
                self.refuse(ours, where)
                continue
            self.accepted += 1
            self.assertTrue(ours["ok"], where)
            for key, value in expected.items():
                self.assertEqual(set(ours[key]) if key == "alarms" else ours[key], value, where)
            for key in ("counts", "turns", "alarms", "address", "data"):
                self.assertEqual(key in ours, key in expected, where)
            if bits and "counts" in expected:
                self.assertTrue(math.isclose(ours["angle_deg"], expected["counts"] * 360 / 2**bits, rel_tol=1e-12), where)


class TFormat(Decoded):
    def good(self, bits, turn_bits, enid):
        """A frame of any kind."""
        chance = self.chance
        name = chance.choice(list(tformat.CODES))
        if name in ("6", "D"):
            address, busy = chance.randrange(tformat.CELLS), chance.random() < 0.2
            if name == "D" and chance.random() < 0.3:
                return tformat.eeprom_read_request(address)
            return tformat.with_crc([tformat.control(name), address | busy << 7, 0 if busy else chance.randrange(256)])
        if chance.random() < 0.1:
            return tformat.read_request(name)
        encoder = tformat.Encoder(lambda now: now)
        encoder.alarms = chance.choice((0, 0, tformat.OS, tformat.FS, tformat.CE, tformat.OF, tformat.ME, tformat.BE, tformat.BA,
                                        chance.randrange(256) & ~tformat_reader.FIXED_ALMC))
        status = (tformat.COUNTING_ERROR if encoder.alarms & tformat.CE else 0) | (
            tformat.TURNS_OR_BATTERY if encoder.alarms & (tformat.ME | tformat.BE | tformat.BA) else 0)
        parts = {"ABS": chance.randrange(2**bits).to_bytes(3, "little"), "ABM": chance.randrange(2**turn_bits).to_bytes(3, "little"),
                 "ENID": bytes([enid]), "ALMC": bytes([encoder.alarms])}
        return tformat.with_crc(bytes([tformat.control(name), status]) + b"".join(parts[part] for part in tformat.DATA[name]))

    def frame(self, *model):
        chance, frame = self.chance, self.good(*model)
        kind = chance.randrange(8)
        if kind == 0:
            return flipped(frame, chance)
        if kind == 1:
            return resized(frame, chance, chance.randbytes)
        if kind in (2, 3) and len(frame) > 2:  # damaged, but with a CRC that fits
            return tformat.with_crc(flipped(frame[:-1], chance, 2))
        if kind == 4:
            return tformat.with_crc(chance.randbytes(chance.choice((1, 2, 3, 5, 10))))
        return frame

    def test_tformat(self):
        for bits, turn_bits in ((17, 16), (23, 16), (17, 0), (24, 24), (1, 1)):
            enid = self.chance.choice((None, 0x11))
            settings = [f"bits={bits}", f"turn_bits={turn_bits}"] + ([f"enid={enid}"] if enid is not None else [])
            frames = [self.frame(bits, turn_bits, 0x11 if enid or self.chance.random() < 0.5 else self.chance.randrange(256))
                      for _ in range(CASES // 5)]
            cases = [(frame.hex(" "), tformat_reader.read(frame, bits, turn_bits, enid)) for frame in frames if frame]
            self.compare("tformat", settings, cases, bits=bits)


class SaaSerial(Decoded):
    def read(self, frame, bits, address):
        if frame[:2] == b"\xBC\xAA":
            kinds = {0xB: "read_position_request", 0xC: "zero_request"}
            return {"kind": kinds[frame[2] >> 4], "command": f"0x{frame[2]:02x}"} if len(frame) == 3 and frame[2] >> 4 in kinds else None
        for second in (0x81, 0xB0 | address):
            try:
                positions = saa_serial.positions(frame, bits, second)
            except ValueError:
                continue
            if len(positions) == 1 and len(frame) == saa_serial.data_bytes(bits) + 3 and not positions[0] >> bits:
                return {"kind": "position_reply", "counts": positions[0]} | ({"address": f"0x{second:02x}"} if second != 0x81 else {})
        return None

    def frame(self, bits, address):
        chance = self.chance
        kind = chance.randrange(8)
        if kind == 7:
            return bytes([0xBC, 0xAA, chance.choice((0xB0, 0xC0)) | address]) + chance.choice((b"", b"", b"\0"))
        second = 0x81 if kind % 2 else 0xB0 | address
        frame = saa_serial.frame(chance.randrange(2**bits), bits, second)
        if kind == 0:
            return flipped(frame, chance)
        if kind == 1:
            return resized(frame, chance, chance.randbytes)
        if kind == 2:  # more bits than there are, or another address; the sum fits
            body = flipped(frame[:-1], chance, 1)
            return body + bytes([sum(body) % 256])
        return frame

    def test_saa_serial(self):
        for bits in range(10, 27):
            address = self.chance.randrange(16)
            frames = [self.frame(bits, address) for _ in range(CASES // 17)]
            # The manual does not state what else may follow the two bytes of a command: neither side accepts it.
            cases = [(frame.hex(), self.read(frame, bits, address)) for frame in frames if frame]
            self.compare("saa-serial", [f"bits={bits}", f"address={address}"], cases, bits=bits)


class SaaCan(Decoded):
    def frame(self, bits, node, big):
        """Identifier and data of a frame, good or not."""
        chance = self.chance
        kind = chance.randrange(8)
        if kind == 0:
            return saa_can.command(node, chance.choice(list(saa_can.COMMANDS)), chance.randrange(1, 256))
        number, data = saa_can.position(node, chance.randrange(2**bits), saa_can.bytes_of(bits), big)
        if kind == 1:
            return number, data[:chance.randrange(9)]
        if kind == 2:
            return number ^ 1 << chance.randrange(11), data
        if kind == 3:  # beyond the resolution, unless all bits are used
            return number, chance.randbytes(saa_can.bytes_of(bits)).ljust(8, b"\0")
        if kind == 4:
            return 0x200 + node, bytes([chance.randrange(256), node if chance.random() < 0.7 else chance.randrange(256)]).ljust(8, b"\0")
        return number, data

    def candump(self, frames):
        """The frames as python-can writes a log of can-utils."""
        with tempfile.NamedTemporaryFile("w+", suffix=".log") as file:
            with can.CanutilsLogWriter(file.name) as writer:
                for number, data in frames:
                    writer(can.Message(arbitration_id=number, data=data, is_extended_id=False, channel="can0"))
            return [line.rstrip("\n") for line in pathlib.Path(file.name).read_text(encoding="ascii").splitlines()]

    def test_saa_can(self):
        for bits in range(10, 27):
            node, big = self.chance.randrange(1, 256), self.chance.random() < 0.3
            frames = [self.frame(bits, node, big) for _ in range(CASES // 17)]
            frames = [(number, data) for number, data in frames if number not in (0x7E4, 0x7E5)]
            expected = [saa_can.read(number, data, bits, node, big) for number, data in frames]
            settings = [f"bits={bits}", f"node={node}", f"byte_order={'big' if big else 'little'}"]
            self.compare("saa-can", settings, list(zip(self.candump(frames), expected, strict=True)), bits=bits)


class Ssi(Decoded):
    def encoder(self):
        chance = self.chance
        tree = chance.random() < 0.25
        bits = chance.randint(1, 13) if tree else chance.randint(1, 32)
        turn_bits = chance.randint(0, 12 if tree else min(31, 32 - bits)) if chance.random() < 0.6 else 0
        made = {"bits": bits, "turn_bits": turn_bits, "gray": chance.random() < 0.6, "separate": chance.random() < 0.4, "tree": tree,
                "trailing": chance.choice(("unchecked", "zero", "repeat")), "repeat": chance.choice(("none", "none", "one_zero", "no_gap")),
                "words": chance.randint(2, 4)}
        if made["repeat"] != "none" and made["trailing"] == "zero":
            made["trailing"] = "repeat"
        if not tree:
            made["first_bit"] = chance.randint(1, 5) if chance.random() < 0.3 else 1
            end = made["first_bit"] + turn_bits + bits - 1
            if chance.random() < 0.4:
                made["status"] = {"fault": (end + 1, chance.randint(0, 1)), "warm": (end + 2, chance.randint(0, 1))}
                end += 2
            if chance.random() < 0.4:
                made["parity"] = (chance.choice(("even", "odd")), end + 1)
        return ssi.Encoder(**made)

    def samples(self, encoder):
        chance = self.chance
        active = [name for name in encoder.status if chance.random() < 0.3]
        word = encoder.word(chance.randrange(2**encoder.bits), chance.randrange(2**encoder.turn_bits), active)
        kind = chance.randrange(6)
        if kind == 0:
            return word
        samples = encoder.transfer(word, chance.choice((0, 0, 1, 2, chance.randrange(12))))
        if kind == 1:
            return resized(samples, chance, lambda n: chance.choice("01") * n)
        if kind in (2, 3):
            places = {chance.randrange(len(samples)) for _ in range(chance.randint(1, 2))}
            return "".join("10"[int(bit)] if place in places else bit for place, bit in enumerate(samples))
        return "1" * len(samples) if chance.random() < 0.02 else samples

    def test_ssi(self):
        for _ in range(40):
            encoder = self.encoder()
            cases = []
            for samples in filter(None, (self.samples(encoder) for _ in range(CASES // 40))):
                found = encoder.read(samples)
                if found is not None:
                    counts, turns, active = found
                    found = {"counts": counts} | ({"turns": turns} if encoder.turn_bits else {}) | (
                        {"alarms": active} if encoder.status else {})
                cases.append((samples, found))
            self.compare("ssi", encoder.settings(), cases, "--bits", bits=encoder.bits)


class BissC(Decoded):
    """5.6, at every resolution, with turns, and with other polynomials."""

    def setUp(self):
        super().setUp()
        chance = self.chance
        self.models = [(bits, 0, "1000011", True) for bits in range(10, 33)]
        self.models += [(chance.randint(10, 28), chance.randint(1, 24), "1000011", True) for _ in range(8)]
        for _ in range(8):
            width = chance.randint(3, 16)
            self.models.append((chance.randint(10, 28), chance.randint(0, 24), f"1{chance.getrandbits(width - 1):0{width - 1}b}1", chance.random() < 0.5))

    def expected(self, body, bits, turn_bits, polynomial, inverted):
        width = len(polynomial) - 1
        if len(body) != bits + turn_bits + 2 + width or biss.check(body[:-width], polynomial, inverted) != body[-width:]:
            return None
        error, warning = body[-width - 2:-width]
        found = {"counts": int(body[turn_bits:turn_bits + bits], 2), "alarms": {"error"} if error == "0" else set()}
        if warning == "0":
            found["alarms"].add("warning")
        return found | ({"turns": int(body[:turn_bits], 2)} if turn_bits else {})

    def body(self, bits, turn_bits, polynomial, inverted):
        chance = self.chance
        return biss.frame(chance.getrandbits(bits), bits, chance.getrandbits(turn_bits) if turn_bits else 0, turn_bits,
                          chance.random() < 0.2, chance.random() < 0.2, polynomial=polynomial, inverted=inverted)

    def damaged(self, samples):
        chance = self.chance
        if chance.random() < 0.5:
            return samples
        if chance.random() < 0.3:
            return resized(samples, chance, lambda n: chance.choice("01") * n)
        places = {chance.randrange(len(samples)) for _ in range(chance.randint(1, 6))}
        return "".join("10"[int(bit)] if place in places else bit for place, bit in enumerate(samples))

    def settings(self, bits, turn_bits, polynomial, inverted):
        return [f"bits={bits}", f"turn_bits={turn_bits}", f"crc_bits={len(polynomial) - 1}", f"crc_poly={hex(int(polynomial, 2))}",
                f"crc_inverted={str(inverted).lower()}"]

    def test_frames(self):
        for model in self.models:
            bodies = filter(None, (self.damaged(self.body(*model)) for _ in range(CASES // len(self.models))))
            self.compare("biss", self.settings(*model), [(body, self.expected(body, *model)) for body in bodies], "--bits", bits=model[0])

    def test_transfers(self):
        """Idle line, acknowledgement, start bit, a fixed 0, the frame."""
        chance = self.chance
        for model in self.models:
            bits, turn_bits, polynomial, _ = model
            size = bits + turn_bits + 2 + len(polynomial) - 1
            cases = []
            for _ in range(CASES // len(self.models)):
                delay, busy = chance.randrange(6), chance.randint(1, 9)
                samples = self.damaged(biss.transfer(self.body(*model), delay + busy + size + chance.randint(0, 12), delay, busy))
                cases.append((samples, self.transfer(samples, size, model)))
            self.compare("biss", [*self.settings(*model), "frame=transfer"], [case for case in cases if case[0]], "--bits", bits=bits)

    def transfer(self, samples, size, model):
        """The host's first two samples are before the acknowledgement, which is the first 0; the first 1 after it is the start bit."""
        ack = samples.find("0")
        start = samples.find("1", ack) if ack >= 2 else -1
        if start < 0 or samples[start + 1:start + 2] != "0":
            return None
        body = samples[start + 2:start + 2 + size]
        found = self.expected(body, *model)
        return None if found is None else found | {"ack_at": ack, "start_at": start}


class Requests(unittest.TestCase):
    """The requests of our drivers, read by the others: all of them."""

    def test_requests_of_tformat(self):
        names = [name for name in tformat.CODES if name not in ("6", "D")]
        found = made([f"tformat {int(name, 16)}" for name in names])
        self.assertEqual([bytes.fromhex(text) for text in found], [tformat.read_request(name) for name in names])
        cells = range(tformat.CELLS)
        self.assertEqual([bytes.fromhex(text) for text in made([f"tformat_cell {cell}" for cell in cells])],
                         [tformat.eeprom_read_request(cell) for cell in cells])
        writes = [(cell, value) for cell in cells for value in range(256)]
        self.assertEqual([bytes.fromhex(text) for text in made([f"tformat_write {cell} {value}" for cell, value in writes])],
                         [tformat.eeprom_write_request(*write) for write in writes])

    def test_requests_of_saa_serial(self):
        commands = [*range(0xB0, 0xD0)]
        self.assertEqual([bytes.fromhex(text) for text in made([f"saa_serial {command}" for command in commands])],
                         [bytes([0xBC, 0xAA, command]) for command in commands])

    def test_requests_of_saa_can(self):
        wanted = [(code, node, value) for code in saa_can.COMMANDS for node in range(1, 256)
                  for value in (range(256) if code == 0x31 else (0,))]
        found = made([f"saa_can {code} {node} {value}" for code, node, value in wanted])
        for (code, node, value), text in zip(wanted, found, strict=True):
            number, data = saa_can.command(node, code, value)
            self.assertEqual(text, f"{number:03X}#{data.hex()}")
        services = {f"saa_can_node {node}": [0x11, node] for node in range(1, 256)}
        services |= {f"saa_can_rate {code}": [0x13, 0, code] for code in saa_can.BIT_RATES}
        self.assertEqual(made(services), [f"{saa_can.CONFIGURATION:03X}#{bytes(data).ljust(8, bytes(1)).hex()}" for data in services.values()])


if __name__ == "__main__":
    unittest.main()
