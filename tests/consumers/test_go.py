"""Go: the types against those of lcm-gen, the receiver against the one in Python, the unit tests, and what the generator refuses."""

import os
import pathlib
import random
import struct
import subprocess
import sys
import tempfile
import unittest

from random_messages import Maker, frames, split

PACKAGE = pathlib.Path(os.environ["AXLECAST_PYTHON_PACKAGE"])
WORK = pathlib.Path(os.environ["AXLECAST_CONSUMERS"])
sys.path[:0] = [str(PACKAGE), str(WORK / "python")]
import axlecast  # noqa: E402 pylint: disable=wrong-import-position
import probe  # noqa: E402 pylint: disable=wrong-import-position
from axlecast.receiver import _datagrams  # noqa: E402 pylint: disable=wrong-import-position
from axlecast.udpm import Assembler  # noqa: E402 pylint: disable=wrong-import-position

SOURCE = pathlib.Path(os.environ["AXLECAST_SOURCE"])
GO_MODULE = pathlib.Path(os.environ["AXLECAST_GO_MODULE"])
MESSAGES = min(int(os.environ.get("AXLECAST_CASES", "1000")), 10_000)  # of each type
REPLACEMENT = "\ufffd".encode()  # of what is no UTF-8: Python replaces it, Go keeps it


class Messages(unittest.TestCase):
    def setUp(self):
        self.makers = [Maker(SOURCE / "lcmtypes", axlecast, 1), Maker(SOURCE / "tests/consumers/types", probe, 2)]

    def recoded(self, messages):
        """The messages, decoded and encoded by Go; b"" if it refuses one."""
        done = subprocess.run([WORK / "recode"], input=frames(messages), stdout=subprocess.PIPE, check=True)
        return split(done.stdout)

    def test_random_messages_of_every_type(self):
        types = 0
        for maker in self.makers:
            for name in maker.structs:
                messages = [maker.encoded(name) for _ in range(MESSAGES)]
                self.assertTrue(self.recoded(messages) == messages, name)
                types += 1
        self.assertGreaterEqual(types, 31)

    def test_damaged_messages(self):
        """Go refuses what is damaged, or reads what the Python types read."""
        chance, read = random.Random(3), 0
        for maker in self.makers[:1]:
            for name in maker.structs:
                messages = [damaged(chance, maker.encoded(name)) for _ in range(500)]
                accepted = [(message, recoded) for message, recoded in zip(messages, self.recoded(messages)) if recoded]
                python = [reencoded(name, message) for message, _ in accepted]  # with other bits of some NaNs
                self.assertEqual(self.recoded(python), python)
                for (message, recoded), other in zip(accepted, python):
                    self.assertEqual(message[:len(recoded)], recoded)
                    if REPLACEMENT not in other:
                        self.assertEqual(len(other), len(recoded))
                read += len(accepted)
        self.assertGreater(read, 1_000)

    def test_fingerprints(self):
        for maker, module in zip(self.makers, (axlecast, probe)):
            for name in maker.structs:
                expected = getattr(module, name)._get_packed_fingerprint()  # pylint: disable=protected-access
                text = next(path for path in WORK.glob("go/probe/*_lcm.go") if path.name == f"{name}_lcm.go").read_text() \
                    if module is probe else (GO_MODULE / f"{name}_lcm.go").read_text()
                self.assertIn(f"Fingerprint uint64 = 0x{expected.hex()}\n", text)


def reencoded(name, message):
    """What the Python type makes of a message."""
    return getattr(axlecast, name).decode(message).encode()


def damaged(chance, message):
    """A message with other bytes behind its fingerprint, or with fewer or more of them."""
    changed = bytearray(message)
    for _ in range(chance.randrange(1, 4)):
        if len(changed) > 8:
            changed[chance.randrange(8, len(changed))] = chance.choice((0, 1, 127, 128, 255, chance.randrange(256)))
    return bytes(changed[:chance.randrange(8, len(changed) + 1)] if chance.random() < 0.3 else changed + b"x" * chance.randrange(3))


class Datagrams(unittest.TestCase):
    """Random streams of datagrams: the Assembler of Go gives the messages and counters of the one in Python."""

    def answers(self, stream):
        given = frames(struct.pack(">QH", utime, port) + datagram for utime, port, datagram in stream)
        done = subprocess.run([WORK / "assemble"], input=given, stdout=subprocess.PIPE, check=True)
        return done.stdout.decode()

    def expected(self, stream):
        assembler, lines = Assembler(), []
        for utime, port, datagram in stream:
            message = assembler.add(datagram, ("10.0.0.1", port), utime)
            if message is not None:
                lines.append(f"{message.channel.encode().hex()} {message.data.hex()}\n")
        counters = (assembler.received, assembler.malformed, assembler.lost, assembler.repeated)
        return "".join(lines) + " ".join(map(str, counters)) + "\n"

    def test_random_streams(self):
        chance = random.Random(5)
        for _ in range(60):
            stream = random_stream(chance, 2_000)
            self.assertEqual(self.answers(stream), self.expected(stream))

    def test_messages_of_any_size(self):
        chance, stream = random.Random(6), []
        for number, size in enumerate([0, 1, 65_000, 65_493, 65_494, 65_600, 131_000, 1_000_000]):
            parts = list(_datagrams(number, b"BIG/x", chance.randbytes(size)))
            chance.shuffle(parts)
            stream += [(0, 1, part) for part in parts]
        answer = self.answers(stream)
        self.assertEqual(answer, self.expected(stream))
        self.assertEqual(answer.splitlines()[-1], "8 0 0 0")


def random_stream(chance, length):
    """Datagrams of three senders, with loss, repetition, disorder, restarts, silence, contradictions and bytes of any kind."""
    stream, utime, numbers = [], 1_000_000, [chance.getrandbits(32) for _ in range(3)]
    while len(stream) < length:
        port = chance.randrange(3)
        size = chance.choice((3, 50, 300))
        parts = cut(chance, numbers[port], chance.randbytes(size)) if chance.random() < 0.4 else \
            [struct.pack(">II", 0x4C433032, numbers[port]) + chance.choice((b"A", b"POSITION/x", b"LCM_SELF_TEST")) + b"\0" + chance.randbytes(size)]
        stream += [(utime, port, part) for part in parts if chance.random() < 0.95]
        numbers[port] = (numbers[port] + 1 + (chance.random() < 0.05) * chance.choice((1, 100, 5_000, 1 << 25))) & 0xFFFFFFFF
        utime += chance.choice((10, 1_000, 60_000, 300_000 if chance.random() < 0.1 else 0))
        if chance.random() < 0.02:
            numbers[port] = chance.choice((0, (numbers[port] - 200) & 0xFFFFFFFF))
        if stream and chance.random() < 0.1:
            stream.append((utime, *stream[max(0, len(stream) - chance.randrange(1, 40))][1:]))
        if stream and chance.random() < 0.05:
            old = bytearray(chance.choice(stream[-20:])[2])
            old[chance.randrange(len(old))] = chance.randrange(256)
            stream.append((utime, port, bytes(old[:chance.randrange(1, len(old) + 1)])))
    return stream


def cut(chance, number, data):
    """The fragments of a message, sometimes in another order."""
    size = chance.randrange(1, 120)
    offsets = range(0, len(data), size)
    parts = [struct.pack(">IIIIHH", 0x4C433033, number, len(data), offset, index, len(offsets)) + (b"BIG\0" if index == 0 else b"")
             + data[offset:offset + size] for index, offset in enumerate(offsets)]
    if chance.random() < 0.3:
        chance.shuffle(parts)
    return parts


class Source(unittest.TestCase):
    def go(self, folder, *words, **environment):
        done = subprocess.run([os.environ["AXLECAST_GO"], *words], cwd=folder, capture_output=True, text=True,
                              env={**os.environ, **environment})
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout

    def samples(self):
        """A file with messages of every type."""
        path = WORK / "samples"
        makers = [Maker(SOURCE / "lcmtypes", axlecast, 7), Maker(SOURCE / "tests/consumers/types", probe, 8)]
        path.write_bytes(frames(maker.encoded(name) for maker in makers for name in maker.structs for _ in range(5)))
        return {"AXLECAST_MESSAGES": str(path)}

    def test_unit_tests(self):
        subprocess.run(["ip", "link", "add", "net1", "type", "veth", "peer", "name", "net2"], check=True)
        for name in ("net1", "net2"):
            subprocess.run(["sysctl", "--quiet", "--write", f"net.ipv6.conf.{name}.accept_dad=0"], check=True)
            subprocess.run(["ip", "link", "set", name, "up"], check=True)
        self.go(GO_MODULE, "test", "-count=1", "./...", AXLECAST_IPV6_INTERFACE="net1")
        self.go(WORK / "go", "test", "-count=1", "./...", **self.samples())

    def test_no_input_makes_it_panic(self):
        out = self.go(WORK / "go", "test", "-run=^$", "-fuzz=FuzzDecode", "-fuzztime=5s", ".", **self.samples())
        self.assertIn("new interesting", out)
        self.assertIn("new interesting", self.go(GO_MODULE, "test", "-run=^$", "-fuzz=FuzzAdd", "-fuzztime=5s", "./lcm"))

    def test_format_and_vet(self):
        for folder in (GO_MODULE, WORK / "go"):
            out = subprocess.run([pathlib.Path(os.environ["AXLECAST_GO"]).with_name("gofmt"), "-l", "."], cwd=folder, capture_output=True,
                                 text=True, check=True)
            self.assertEqual(out.stdout + out.stderr, "")
            self.go(folder, "vet", "./...")


class Generator(unittest.TestCase):
    """What is refused, with file and line."""

    def test_definitions_that_have_no_types(self):
        generator = SOURCE / "lcmtypes/go/generate.py"
        for text, cause in (("package a; struct b_t { int32_t c[0]; }", "0 is no length of an array"),
                            ("package a; struct b_t { int32_t c[d]; }", "the length d of an array must be"),
                            ("package a;\nstruct b_t { c_t d; }", "the type c_t is not among the files"),
                            ("package a;\nstruct b_t { b_t c; }", "b_t contains itself without end"),
                            ("package a;\nstruct b_t { int32_t c }", "definition.lcm:2: ; is missing before '}'"),
                            ("package a;\nenum b_t { C }", "definition.lcm:2: 'enum' is not supported"),
                            ("package a; struct b_t { int32_t c, c; }", "two members of one name"),
                            ("package a; struct b_t { int32_t c_d, cD; }", "two members would be the field CD"),
                            ("package a; struct b_t { const int8_t C = 128; }", "128 is no int8_t"),
                            ("package a; struct decode_t { }", "Decode would be defined twice"),
                            ("package a; struct b_t { int8_t c; } struct d_t { int8_t c; }", "has the fingerprint of"),
                            ("", "the files have no struct")):
            with self.subTest(text), tempfile.TemporaryDirectory() as folder:
                path = pathlib.Path(folder) / "definition.lcm"
                path.write_text(text)
                done = subprocess.run([sys.executable, "-B", generator, path.with_name("refused"), path], capture_output=True, text=True)
                self.assertEqual((done.returncode, done.stdout), (1, ""))
                self.assertIn(cause, done.stderr)
                self.assertFalse(path.with_name("refused").exists())

    def test_comments_of_the_definition(self):
        text = (WORK / "go/probe/tree_t_lcm.go").read_text()
        self.assertIn("// Tree is tree_t.\n//\n// A type that contains itself, and arrays of several dimensions.\ntype Tree struct {", text)
        self.assertIn("\t// Above, and\n\t//\n\t// behind it,\n\t// in two lines.\n\tLeaf Leaf\n", text)
        self.assertIn("\tTreeHalf float64 = 0.5\n", text)
        self.assertIn("// us, UNIX time of the sampling instant\n", (GO_MODULE / "position_t_lcm.go").read_text())


if __name__ == "__main__":
    unittest.main()
