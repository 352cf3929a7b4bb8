"""`axlecast foxglove` with Foxglove's own client from npm, which nobody has changed: channels, messages, slow viewers, access."""

import base64
import json
import os
import pathlib
import re
import socket
import struct
import subprocess
import sys
import unittest
import urllib.request

import lcm_log
from machine import BIN, Machine, one_axis, wait_for

READER = pathlib.Path(os.environ["FOXGLOVE_READER"])
SOURCE = pathlib.Path(os.environ["AXLECAST_SOURCE"])
LIMIT = 120  # s
GROUP = ("239.255.76.67", 7667)

sys.path.insert(0, str(SOURCE / "tests/compatibility"))
from messages import Filler, definitions, fields  # noqa: E402 pylint: disable=wrong-import-position


class AsciiFiller(Filler):
    """Foxglove's writer counts the characters of a text and not its bytes, so that only ASCII can be compared with it."""

    def scalar(self, kind):
        value = super().scalar(kind)
        return value.encode("ascii", "ignore").decode() if kind == "string" else value


def camel(name):
    return "".join(part.capitalize() for part in name.removesuffix("_t").split("_"))


def same(written, read):
    """A field that Python has written, and what the viewer's decoder has read: 64 bits as text, bytes as a list."""
    if hasattr(written, "__slots__"):
        return all(same(getattr(written, name), read[name]) for name in written.__slots__)
    if isinstance(written, (bytes, list, tuple)):
        flat = flattened(written)
        return len(flat) == len(read) and all(map(same, flat, read))
    if isinstance(read, str) and isinstance(written, int):
        return written == int(read)
    return written == read


def flattened(values):
    return [each for value in values for each in (flattened(value) if isinstance(value, (list, tuple)) else [value])]


class Foxglove(Machine):
    def serve(self, *options, config=None):
        """Starts the server and returns its URL."""
        self.config = config or self.write(one_axis())
        self.start("foxglove", BIN / "axlecast", "foxglove", self.config, "--port", "0", *options)
        wait_for(lambda: re.search(r"ws://.*/\n", self.log("foxglove")), lambda: self.log("foxglove"))
        return re.search(r"ws://\S+", self.log("foxglove"))[0]

    def run_axis(self):
        self.simulator(self.config, "rs485-0")
        return self.driver(self.config, "rs485-0")

    def viewer(self, url, *options):
        return subprocess.Popen(["node", READER / "read.mjs", url, *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def view(self, url, *options):
        """What a viewer has seen at its end."""
        viewer = self.viewer(url, *options)
        out, err = viewer.communicate(timeout=LIMIT)
        self.assertTrue(out, err)
        return json.loads(out)

    def test_a_viewer_decodes_the_positions_of_an_axis(self):
        url = self.serve()
        self.assertRegex(url, r"^ws://127\.0\.0\.1:\d+/$")
        self.run_axis()
        for protocol in ("foxglove.websocket.v1", "foxglove.sdk.v1"):
            seen = self.view(url, "--protocol", protocol, "--until", "/POSITION/axis1=300,/DEVICE/axis1=1")
            self.assertEqual(seen["protocol"], protocol)
            self.assertEqual((seen["serverInfo"]["name"], seen["serverInfo"]["capabilities"]), ("test", []))
            position = seen["topics"]["/POSITION/axis1"]
            self.assertEqual((position["channel"]["schemaName"], position["channel"]["encoding"], position["channel"]["schemaEncoding"]),
                             ("axlecast/msg/Position", "cdr", "ros2msg"))
            self.assertEqual(position["gaps"], 0)
            self.assertTrue(all(topic["rewritten"] for topic in seen["topics"].values()), "their own writer makes other bytes")
            last = position["last"]["message"]
            self.assertTrue(last["flag_valid"])
            self.assertEqual(last["flag_valid"], bool(last["flags"] & 1))
            self.assertEqual(last["header"]["stamp"]["sec"], int(last["utime"]) // 1_000_000)
            self.assertEqual(int(position["last"]["timestamp"]), int(last["utime"]) * 1_000)
            self.assertEqual(seen["status"], [])

    def test_every_type_arrives_as_it_was_sent(self):
        url = self.serve()
        types = definitions()
        filler = AsciiFiller(types)
        every = {name: filler.message(definition) for name, definition in types.items()}
        viewer = self.viewer(url, "--until", ",".join(f"/TYPE/{name}=1" for name in every))
        sending = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.addCleanup(sending.close)
        number = 0
        while viewer.poll() is None:
            for name, message in every.items():
                if hasattr(message, "machine_id"):
                    message.machine_id = 0  # of any machine
                sending.sendto(lcm_log.datagram(number, f"TYPE/{name}", message.encode()), GROUP)
                number += 1
            try:
                viewer.wait(0.3)
            except subprocess.TimeoutExpired:
                self.assertLess(number, 10_000)
        out, err = viewer.communicate()
        self.assertEqual(viewer.returncode, 0, err)
        seen = json.loads(out)
        for name, message in every.items():
            with self.subTest(name):
                topic = seen["topics"][f"/TYPE/{name}"]
                self.assertEqual(topic["channel"]["schemaName"], f"axlecast/msg/{camel(name)}")
                self.assertTrue(topic["rewritten"])
                for _, field, _ in fields(name):
                    read = topic["last"]["message"][field]
                    self.assertTrue(same(getattr(message, field), read), f"{field}: {getattr(message, field)!r} is {read!r}")

    def test_types_of_others_are_shown_with_their_file(self):
        (self.folder / "camera.lcm").write_text("""package vision;
            /* What the camera has found. */
            enum_t { }""", encoding="utf-8")
        code, _, err = self.axlecast("foxglove", self.write(one_axis()), "--types", self.folder / "camera.lcm", limit=LIMIT)
        self.assertEqual(code, 1)
        self.assertIn("camera.lcm: line 3: expected package or struct, not 'enum_t'", err)
        (self.folder / "camera.lcm").write_text("""package vision;
            struct point_t { double x, y; }
            struct found_t { // two of them
              const int8_t N = 2;
              int64_t time; int16_t count; point_t corners[count][2]; string label; boolean sure; byte raw[2];
            }""", encoding="utf-8")
        subprocess.run(["lcm-gen", "-p", "--ppath", self.folder, self.folder / "camera.lcm"], check=True)
        sys.path.insert(0, str(self.folder))
        self.addCleanup(sys.path.remove, str(self.folder))
        import vision  # pylint: disable=import-outside-toplevel,import-error

        found = vision.found_t()
        found.time, found.count, found.label, found.sure, found.raw = 7, 3, "kiste ä", True, b"\xff\x01"
        for i in range(3):
            row = []
            for k in range(2):
                point = vision.point_t()
                point.x, point.y = i, k
                row.append(point)
            found.corners.append(row)
        url = self.serve("--types", self.folder / "camera.lcm")
        viewer = self.viewer(url, "--until", "/CAMERA=1,/UNKNOWN=0", "--seconds", "60")
        sending = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.addCleanup(sending.close)
        number = 0
        while viewer.poll() is None:
            for channel, data in (("CAMERA", found.encode()), ("UNKNOWN", bytes(range(30))), ("SHORT", b"abc"), ("CAMERA", found.encode()[:-1])):
                sending.sendto(lcm_log.datagram(number, channel, data), GROUP)
                number += 1
            try:
                viewer.wait(0.3)
            except subprocess.TimeoutExpired:
                self.assertLess(number, 2_000)
        out, err = viewer.communicate()
        self.assertTrue(out, err)
        seen = json.loads(out)
        camera = seen["topics"]["/CAMERA"]
        self.assertEqual(camera["channel"]["schemaName"], "vision/msg/Found")
        message = camera["last"]["message"]
        self.assertEqual([(each["x"], each["y"]) for each in message["corners"]], [(i, k) for i in range(3) for k in range(2)])
        self.assertEqual((message["label"], message["sure"], message["raw"], message["count"]), ("kiste ä", True, [255, 1], 3))
        self.assertNotIn("/UNKNOWN", seen["topics"])
        self.assertRegex(seen["status"][0]["message"], "the type of the messages of 'UNKNOWN' is not known: give its .lcm file with --types")

    def test_a_stalled_viewer_loses_its_own_messages_only(self):
        url = self.serve()
        self.run_axis()
        stalled = self.viewer(url, "--stalled")
        self.addCleanup(stalled.communicate)
        self.addCleanup(stalled.kill)
        seen = self.view(url, "--until", "/POSITION/axis1=2000")
        self.assertEqual(seen["topics"]["/POSITION/axis1"]["gaps"], 0)
        self.assertEqual(seen["status"], [])

    def open(self, url, **headers):
        """A connection that has requested a WebSocket."""
        host, port = url.split("/")[2].split(":")
        head = {"Host": f"{host}:{port}", "Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13",
                "Sec-WebSocket-Key": base64.b64encode(bytes(16)).decode(), "Sec-WebSocket-Protocol": "foxglove.sdk.v1", **headers}
        lines = [f"GET {head.pop('path', '/')} HTTP/1.1", *(f"{name}: {value}" for name, value in head.items() if value), "", ""]
        connection = self.enterContext(socket.create_connection((host, int(port)), timeout=LIMIT))
        connection.sendall("\r\n".join(lines).encode())
        return connection

    def request(self, url, **headers):
        """The status of the answer to the request for a WebSocket."""
        with self.open(url, **headers) as connection:
            return int(connection.recv(200).split()[1])

    def test_who_may_look(self):
        token = self.folder / "token"
        token.write_text("0123456789abcdef\n", encoding="ascii")
        token.chmod(0o600)
        url = self.serve("--token-file", token, "--origin", "https://app.foxglove.dev")
        bearer = {"Authorization": "Bearer 0123456789abcdef"}
        self.assertEqual(self.request(url), 401)
        self.assertEqual(self.request(url, **bearer), 101)
        self.assertEqual(self.request(url, path="/?token=0123456789abcdef"), 101)
        self.assertEqual(self.request(url, path="/?token=0123456789abcdee"), 401)
        self.assertEqual(self.request(url, **bearer, Origin="https://app.foxglove.dev"), 101)
        self.assertEqual(self.request(url, **bearer, Origin="https://evil.example"), 403)
        self.assertEqual(self.request(url, **bearer, Host="evil.example"), 403)
        self.assertEqual(self.request(url, **bearer, path="/ws"), 404)
        for protocols in ("", "axlecast-web-1"):
            self.assertEqual(self.request(url, **bearer, **{"Sec-WebSocket-Protocol": protocols}), 400)
        with urllib.request.urlopen(url.replace("ws://", "http://") + "healthz", timeout=LIMIT) as answer:
            self.assertEqual(answer.read(), b"ok\n")

    def test_what_is_no_request_is_reported(self):
        url = self.serve()
        connection = self.open(url)
        for text in ("[]", '{"op":"subscribe"}', '{"op":"subscribe","subscriptions":[{"id":1,"channelId":-1}]}', "{" * 5_000,
                     '{"op":"subscribe","subscriptions":[{"id":1,"channelId":77}]}', '{"op":"unsubscribe","subscriptionIds":[5]}',
                     '{"op":"advertise","channels":[]}'):
            data = text.encode()
            length = bytes([0x80 | len(data)]) if len(data) < 126 else b"\xfe" + struct.pack(">H", len(data))
            connection.sendall(b"\x81" + length + bytes(4) + data)
        received = b""
        for wanted in (b"not one of the Foxglove protocol", b"channel 77 is not advertised", b"there is no subscription 5",
                       b"it does not support advertise"):
            while wanted not in received:
                more = connection.recv(65_536)
                self.assertTrue(more, received)
                received += more


if __name__ == "__main__":
    unittest.main()
