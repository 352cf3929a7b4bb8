"""axlecast web as a browser meets it: who may look, what is sent, and what a bad or slow reader costs."""

import contextlib
import json
import os
import re
import struct
import subprocess
import unittest

import lcm_log
from machine import BIN, Machine, one_axis, wait_for
from web_client import BINARY, Closed, Link, WebSocket, request, tls_trusting

TOKEN = "5f1d7a3c9be24680"
POLICY = "default-src 'none'"


class Web(Machine):
    def setUp(self):
        super().setUp()
        self.config = self.write(one_axis(simulate="{speed_rpm: 60}"))

    def web(self, *options, name="web"):
        """A server; its port."""
        self.process = self.start(name, BIN / "axlecast", "web", *options, "--port", "0")
        address = lambda: re.search(r"^https?://\S+:(\d+)/$", self.log(name), re.MULTILINE)
        wait_for(lambda: address() or self.process.poll() is not None, "the server's address")
        self.assertIsNone(self.process.poll(), self.log(name))
        return int(address()[1])

    def socket(self, port, **options):
        socket = WebSocket(port, **options)
        self.addCleanup(socket.close)
        self.assertEqual(socket.status, 101)
        return socket

    def live_axis(self):
        self.simulator(self.config, "rs485-0")
        self.driver(self.config, "rs485-0")

    def secret(self, name, text, mode=0o600):
        path = self.write(text, name)
        path.chmod(mode)
        return path

    def certificate(self):
        subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-keyout", self.folder / "web.key",
                        "-out", self.folder / "web.pem", "-days", "2", "-subj", "/CN=localhost",
                        "-addext", "subjectAltName=DNS:localhost"], check=True, capture_output=True)
        (self.folder / "web.key").chmod(0o600)
        return self.folder / "web.pem", self.folder / "web.key"

    # -- HTTP

    def test_serves_the_page_with_headers_that_keep_others_out(self):
        port = self.web(self.config)
        status, headers, page = request(port, "/")
        self.assertEqual(status, 200)
        self.assertIn(b"<html", page)
        self.assertIn(POLICY, headers["content-security-policy"])
        self.assertEqual(headers["x-content-type-options"], "nosniff")
        self.assertFalse([name for name in headers if name.startswith("access-control")])
        for path in re.findall(r'(?:src|href)="([^"]+)"', page.decode()):
            self.assertFalse(re.match(r"(https?:)?//", path), "from elsewhere")
            if not path.startswith(("#", "data:")):
                self.assertEqual(request(port, "/" + path.lstrip("./"))[0], 200, path)
        for path in ("/uPlot.esm.js", "/uPlot.min.css", "/login.html"):
            self.assertEqual(request(port, path)[0], 200, path)
        for path in ("/none", "/../../etc/passwd", "/ws"):
            status, headers, _ = request(port, path)
            self.assertEqual(status, 404, path)
            self.assertIn(POLICY, headers["content-security-policy"])

    def test_sends_a_file_again_only_when_it_is_another(self):
        port = self.web(self.config)
        _, headers, script = request(port, "/uPlot.esm.js")
        self.assertGreater(len(script), 50_000)
        self.assertEqual(request(port, "/uPlot.esm.js", headers={"If-None-Match": headers["etag"]})[0], 304)
        status, head, body = request(port, "/uPlot.esm.js", method="HEAD")
        self.assertEqual((status, int(head["content-length"]), body), (200, len(script), b""))

    def test_answers_under_its_own_names_only(self):
        port = self.web(self.config, "--name", "press3.plant")
        for host, status in {"evil.example": 403, f"127.0.0.1:{port}": 200, "[::1]": 200, "press3.plant:80": 200}.items():
            self.assertEqual(request(port, "/", headers={"Host": host})[0], status, host)
        for headers in ({"Host": "evil.example"}, {"Origin": "http://evil.example"}):
            self.assertEqual(WebSocket(port, headers=headers).status, 403, headers)
        self.socket(port, headers={"Origin": f"http://localhost:{port}"})

    def test_changes_nothing_and_bears_bad_requests(self):
        port = self.web(self.config)
        self.assertEqual(request(port, "/", method="POST", body=b"x")[0], 405)
        self.assertEqual(request(port, "/login", method="POST", body=b"token=x")[0], 401)
        self.assertEqual(request(port, "/login", method="POST", body=b"x" * 100_000)[0], 413)
        for bad in (b"\0" * 100, b"GET\r\n\r\n", b"GET / HTTP/1.1\r\n" + b"a: b\r\n" * 10_000, os.urandom(5000) + b"\r\n\r\n",
                    b"GET /" + b"x" * 100_000 + b" HTTP/1.1\r\n\r\n", b"PUT / HTTP/1.1\r\nContent-Length: -5\r\n\r\n"):
            with self.subTest(bad[:20]):
                self.send_bad(port, bad)
        self.assertEqual(request(port, "/healthz")[0], 200)

    @staticmethod
    def is_open(link):
        link.socket.setblocking(False)
        try:
            return link.socket.recv(1) != b""
        except BlockingIOError:
            return True
        except OSError:
            return False

    def send_bad(self, port, data):
        link = Link(port)
        self.addCleanup(link.close)
        answer = b""
        try:
            link.send(data)
            link.socket.shutdown(1)
            while True:
                answer += link.read(1)
        except (Closed, OSError):
            return answer

    def test_no_upgrade_but_to_a_websocket(self):
        """libwebsockets 4.1 has HTTP/2 in the clear built in, and malformed HTTP/2 ends it in an assertion."""
        port = self.web(self.config)
        preface = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"
        # A SETTINGS frame, then frames of all types on all kinds of streams, cut, oversized and of random bytes.
        frames = b"\0\0\0\4\0\0\0\0\0" + b"".join(
            struct.pack(">I", size)[1:] + bytes([kind, 0xFF]) + struct.pack(">I", stream) + os.urandom(min(size, 64))
            for kind in range(12) for stream in (0, 1, 2**31 - 1) for size in (0, 5, 64))
        h2c = "Connection: Upgrade, HTTP2-Settings\r\nUpgrade: {}\r\nHTTP2-Settings: AAMAAABkAAQAAP__\r\n"
        for upgrade in ("h2c", "H2C", "h2c, websocket", "TLS/1.0", "foo", ""):
            for path in ("/", "/ws"):  # a WebSocket may be asked for at /ws alone
                head = f"GET {path} HTTP/1.1\r\nHost: localhost\r\n{h2c.format(upgrade)}\r\n".encode()
                for data in (head, head + preface + frames, head + os.urandom(5000)):
                    with self.subTest(upgrade=upgrade, path=path):
                        self.assertNotIn(b"101", self.send_bad(port, data)[:20])
        for data in (preface + frames, preface, b"CONNECT localhost:1 HTTP/1.1\r\nHost: localhost\r\n\r\n" + frames):
            self.send_bad(port, data)
        self.assertEqual(request(port, "/healthz")[0], 200)
        self.assertIsNone(self.process.poll(), self.log("web"))
        self.assertEqual(self.socket(port).receive()["type"], "hello")

    def test_those_who_trickle_keep_nobody_out(self):
        port = self.web(self.config, "--clients", "2")
        starts = (b"", b"GET", b"GET / HTTP/1.1\r\nHost: local", b"POST /login HTTP/1.1\r\nHost: localhost\r\nContent-Length: 4000\r\n\r\nx")
        links = []
        for i in range(200):
            link = Link(port)
            self.addCleanup(link.close)
            with contextlib.suppress(OSError):
                link.send(starts[i % len(starts)])
            links.append(link)
            if i % 50 == 49:
                self.assertEqual(request(port, "/healthz")[0], 200)
                self.assertEqual(request(port, "/metrics")[0], 200)
                # Answered at once, and not when those before had run out of their time.
                self.assertTrue(self.is_open(links[i - 25]), i)
        self.assertFalse(self.is_open(links[0]), "the oldest had to go")
        self.assertEqual(self.socket(port).receive()["type"], "hello")

    def test_a_request_that_never_ends_is_closed_and_its_trickle_gains_no_time(self):
        port = self.web(self.config)
        head = b"POST /login HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100000\r\n\r\n"
        for start, more in ((b"GET / HTTP/1.1\r\nHost: localhost\r\nX: ", b"x"), (head, b"x")):
            link = Link(port)
            self.addCleanup(link.close)
            link.send(start)

            def is_closed(link=link, more=more):
                with contextlib.suppress(OSError):
                    link.send(more)
                return not self.is_open(link)

            wait_for(is_closed, "the server gives the request up")
        self.assertEqual(request(port, "/healthz")[0], 200)

    def test_an_address_that_takes_all_connections_takes_none_from_others(self):
        for address in ("192.0.2.1", "192.0.2.2"):
            subprocess.run(["ip", "addr", "add", f"{address}/32", "dev", "lo"], check=True)
        certificate, key = self.certificate()
        port = self.web(self.config, "--bind", "0.0.0.0", "--clients", "32", "--tls-cert", certificate, "--tls-key", key,
                        "--token-file", self.secret("token", TOKEN + "\n"))
        patient = Link(port, source="192.0.2.2")
        self.addCleanup(patient.close)
        greedy = []
        for _ in range(64):  # as many as the server has places
            greedy.append(Link(port, source="192.0.2.1"))
            self.addCleanup(greedy[-1].close)
        # The address may have half of the places: for each connection beyond, the oldest of its own has to go.
        wait_for(lambda: sum(map(self.is_open, greedy)) <= 32, "the address gives up its oldest connections")
        self.assertTrue(self.is_open(greedy[-1]))
        self.assertTrue(self.is_open(patient), "a connection of another address")
        self.assertEqual(request(port, "/healthz", tls=tls_trusting(certificate))[0], 200)

    def test_tells_prometheus_and_its_health(self):
        self.live_axis()
        port = self.web(self.config)
        status, headers, health = request(port, "/healthz")
        self.assertEqual((status, json.loads(health)), (200, {"status": "ok"}))
        metrics = wait_for(lambda: (lambda text: "axis1" in text and text)(request(port, "/metrics")[2].decode()), "a metric")
        check = subprocess.run(["promtool", "check", "metrics"], input=metrics, capture_output=True, text=True)
        self.assertEqual(check.returncode, 0, check.stdout + check.stderr)

    # -- who may look

    def test_another_address_needs_tls_and_a_token(self):
        certificate, key = self.certificate()
        token = self.secret("token", TOKEN)
        tls = ("--tls-cert", certificate, "--tls-key", key)
        for options, missing in (((), "needs tls_cert"), (tls, "needs a token"), (("--token-file", token), "needs tls_cert"),
                                 (tls[:2], "needs tls_key beside it")):
            code, _, err = self.axlecast("web", self.config, "--bind", "0.0.0.0", *options)
            self.assertEqual(code, 2, err)
            self.assertIn(missing, err)

    def test_secrets_that_others_can_read_are_refused(self):
        certificate, key = self.certificate()
        for text, mode, why in ((TOKEN, 0o644, "open to other users"), ("short", 0o600, "could be guessed")):
            token = self.secret("token", text, mode)
            code, _, err = self.axlecast("web", self.config, "--port", "0", "--token-file", token)
            self.assertEqual(code, 1, err)
            self.assertIn(why, err)
            self.assertNotIn(text + "\n", err)
        key.chmod(0o644)
        code, _, err = self.axlecast("web", self.config, "--port", "0", "--tls-cert", certificate, "--tls-key", key)
        self.assertEqual(code, 1, err)
        self.assertIn("web.key", err)

    def test_over_tls_the_token_opens_and_nothing_else_does(self):
        certificate, key = self.certificate()
        port = self.web(self.config, "--bind", "0.0.0.0", "--tls-cert", certificate, "--tls-key", key,
                        "--token-file", self.secret("token", TOKEN + "\n"))
        tls = tls_trusting(certificate)
        status, _, page = request(port, "/", tls=tls)
        self.assertEqual(status, 401)
        self.assertIn(b"token", page)
        self.assertEqual(request(port, "/metrics", tls=tls)[0], 401)
        self.assertEqual(request(port, "/healthz", tls=tls)[0], 200)
        self.assertEqual(WebSocket(port, tls=tls).status, 401)
        self.assertEqual(request(port, "/login", "POST", body=b"token=" + b"0" * 16, tls=tls)[0], 401)
        status, headers, _ = request(port, "/login", "POST", body=b"token=" + TOKEN.encode(), tls=tls)
        self.assertEqual((status, headers["location"]), (303, "/"))
        for part in ("HttpOnly", "Secure", "SameSite=Strict"):
            self.assertIn(part, headers["set-cookie"])
        cookie = {"Cookie": headers["set-cookie"].split(";")[0]}
        self.assertEqual(request(port, "/", headers=cookie, tls=tls)[0], 200)
        self.assertEqual(self.socket(port, headers=cookie, tls=tls).receive()["type"], "hello")
        bearer = {"Authorization": "Bearer " + TOKEN}
        self.assertEqual(request(port, "/metrics", headers=bearer, tls=tls)[0], 200)
        self.send_bad(port, b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")  # plain HTTP
        self.assertEqual(request(port, "/healthz", tls=tls)[0], 200)
        self.assertNotIn(TOKEN, self.log("web"))

    def test_an_address_that_is_taken_is_named(self):
        port = self.web(self.config)
        code, _, err = self.axlecast("web", self.config, "--port", port)
        self.assertEqual(code, 4)
        self.assertIn(str(port), err)

    # -- the WebSocket

    def test_shows_the_live_machine(self):
        self.live_axis()
        socket = self.socket(self.web(self.config))
        hello = socket.receive()
        self.assertEqual((hello["type"], hello["machine"], hello["mode"]), ("hello", "test", "live"))
        self.assertEqual([device["device"] for device in hello["devices"]], ["axis1"])
        state, _ = socket.until(lambda frame: frame["type"] == "state" and frame["devices"][0]["state"] == "ONLINE")
        socket.ask(type="subscribe", devices=["axis1"], history_s=10)
        times = []
        while len(times) < 300:
            frame, _ = socket.until(lambda frame: frame["type"] == "samples")
            self.assertEqual(len(frame["columns"]["value"]), len(frame["dt_us"]))
            times += [frame["t0_utime"] + dt for dt in frame["dt_us"]]
        self.assertEqual(times, sorted(times))
        self.set_simulated(self.config, "rs485-0", fault="off")
        alarms, _ = socket.until(lambda frame: frame["type"] == "alarms" and frame["appeared"])
        self.assertEqual(alarms["device"], "axis1")
        self.assertTrue(alarms["entries"][0]["action"])
        self.set_simulated(self.config, "rs485-0", fault="none")
        socket.until(lambda frame: frame["type"] == "alarms" and frame["cleared"])

    def test_bears_bad_frames(self):
        port = self.web(self.config)
        socket = self.socket(port)
        for text in ("", "nonsense", "[]", '{"type": "zero", "device": "axis1"}', '{"type": "subscribe", "devices": ["axis9"]}',
                     '{"type": "play"}', "[" * 16_000):
            socket.send_frame(text.encode())
            socket.until(lambda frame: frame["type"] == "error")
        for data, opcode, codes in ((b"\xff\xfe", 1, {1007}), (b"x", BINARY, {1003}), (b"x" * 20_000, 1, {1009}),
                                    (b"x" * 20_000_000, 1, {1009, None}), (b"x", 5, {1002, None})):
            socket = self.socket(port)
            try:
                socket.send_frame(data, opcode)
            except ConnectionError:
                continue
            self.assertIn(socket.closed(), codes, (data[:5], opcode))
        socket = self.socket(port)
        with contextlib.suppress(ConnectionError):  # it may be closed before all are sent
            for _ in range(200):
                socket.ask(type="pause")
        self.assertIn(socket.closed(), (1008, None))
        with self.assertRaises((Closed, ConnectionError)):
            WebSocket(port, protocol="chat")
        self.assertEqual(self.socket(port).receive()["type"], "hello")

    def test_takes_as_many_browsers_as_allowed(self):
        port = self.web(self.config, "--clients", 2)
        sockets = [self.socket(port) for _ in range(2)]
        self.assertEqual(WebSocket(port).status, 503)
        self.assertEqual(request(port, "/healthz")[0], 200)
        sockets[0].close()
        wait_for(lambda: WebSocket(port).status == 101, "room for another one")

    def test_a_slow_reader_gets_the_newest_samples_and_every_alarm(self):
        self.live_axis()
        port = self.web(self.config)
        slow = self.socket(port, receive_buffer=4096)
        fast = self.socket(port)
        slow.until(lambda frame: frame["type"] == "state" and frame["devices"][0]["state"] == "ONLINE")
        slow.ask(type="subscribe", devices=["axis1"])
        fast.ask(type="subscribe", devices=["axis1"])
        changes = []
        for fault in ("off", "none") * 2:
            self.set_simulated(self.config, "rs485-0", fault=fault)
            wish = "appeared" if fault == "off" else "cleared"
            alarms, _ = fast.until(lambda frame: frame["type"] == "alarms" and frame[wish])
            changes.append((wish, alarms[wish]))
        # Enough for what waits on the way to the slow one to fill up.
        samples = 0
        while samples < 6000:
            frame, _ = fast.until(lambda frame: frame["type"] == "samples")
            samples += len(frame["dt_us"])
        self.assertEqual(frame["dropped"], 0)
        newest = frame["t0_utime"]
        caught_up, before = slow.until(lambda frame: frame["type"] == "samples" and frame["t0_utime"] >= newest)
        self.assertGreater(caught_up["dropped"], 0)
        seen = [(wish, frame[wish]) for frame in before if frame["type"] == "alarms" for wish in ("appeared", "cleared")
                if frame[wish]]
        for change in changes:
            self.assertIn(change, seen)

    def test_two_servers_show_the_same_and_end_when_asked(self):
        ports = [self.web(self.config, name=name) for name in ("web1", "web2")]
        for port in ports:
            self.assertEqual(self.socket(port).receive()["machine"], "test")
        for process in self.processes[-2:]:
            process.terminate()
            self.assertEqual(process.wait(20), 0)

    def test_up_starts_the_page_with_the_machine(self):
        up = self.start("up", BIN / "axlecast", "up", self.config, "--web", "--no-table")

        def online():
            try:
                return request(8380, "/healthz")[0] == 200
            except ConnectionError:
                return False
        wait_for(online, lambda: "the page of " + self.log("up"))
        self.assertIn("page: http://127.0.0.1:8380/", self.log("up"))
        socket = self.socket(8380)
        socket.until(lambda frame: frame["type"] == "state" and frame["devices"][0]["state"] == "ONLINE")
        up.terminate()
        self.assertEqual(up.wait(60), 0)
        with self.assertRaises(ConnectionError):
            request(8380, "/healthz")

    # -- a log

    def log_of(self, seconds):
        self.live_axis()
        log = self.folder / "run.lcm"
        recorder = self.start("record", BIN / "axlecast", "record", log, "--config", self.config)
        watch = self.watch(self.config)
        wait_for(lambda: len(watch.of("DEVICE/axis1")) > seconds, "a log of some seconds")
        recorder.terminate()
        self.assertEqual(recorder.wait(60), 0)
        return log

    def test_plays_a_log_forth_and_back(self):
        log = self.log_of(8)
        for process in self.processes:
            process.kill()
        socket = self.socket(self.web("--log", log))
        hello = socket.receive()
        self.assertEqual((hello["mode"], hello["machine"], hello["log"]["files"]), ("log", "test", ["run.lcm"]))
        first, last = hello["log"]["first_utime"], hello["log"]["last_utime"]
        socket.until(lambda frame: frame["type"] == "state" and frame["devices"][0]["state"] == "ONLINE")
        socket.ask(type="subscribe", devices=["axis1"], history_s=100)
        socket.ask(type="seek", utime=last - 1_000_000)
        there, _ = socket.until(lambda frame: frame["type"] == "playback" and not frame["seeking"]
                                and frame["utime"] > last - 1_500_000)
        self.assertFalse(there["playing"])
        samples, _ = socket.until(lambda frame: frame["type"] == "samples")
        self.assertLess(samples["t0_utime"], first + 2_000_000)
        socket.ask(type="speed", factor=10)
        socket.ask(type="play")
        socket.until(lambda frame: frame["type"] == "playback" and frame["at_end"])
        socket.ask(type="seek", utime=first)
        socket.until(lambda frame: frame["type"] == "reset")
        back, _ = socket.until(lambda frame: frame["type"] == "playback" and not frame["seeking"])
        self.assertLess(back["utime"], first + 1_000_000)

    def played(self, log, name):
        """All frames of a server that plays the log from its start to its end."""
        socket = self.socket(self.web("--log", log, name=name))
        socket.ask(type="speed", factor=20)
        socket.ask(type="play")
        _, frames = socket.until(lambda frame: frame["type"] == "playback" and frame["at_end"])
        return frames

    def test_shows_a_log_without_its_machines_file_and_a_damaged_one(self):
        data = self.log_of(4).read_bytes()
        bare = [record for record in lcm_log.whole_records(data) if b"AXLECAST/" not in record[28:37]]
        (self.folder / "bare.lcm").write_bytes(b"".join(bare))
        hellos = [frame for frame in self.played(self.folder / "bare.lcm", "bare") if frame["type"] == "hello"]
        self.assertEqual([device["device"] for device in hellos[-1]["devices"]], ["axis1"])
        self.assertIn("does not contain the machine's file", self.log("bare"))
        middle = len(data) // 2
        (self.folder / "damaged.lcm").write_bytes(data[:middle] + os.urandom(1000) + data[middle + 1000:-5])
        states = [frame for frame in self.played(self.folder / "damaged.lcm", "damaged") if frame["type"] == "state"]
        self.assertEqual(states[-1]["devices"][0]["state"], "ONLINE")

    def test_a_log_that_is_none_is_refused(self):
        code, _, err = self.axlecast("web", "--log", self.folder / "none.lcm", "--port", "0")
        self.assertEqual(code, 1)
        self.assertIn("none.lcm", err)
        code, _, err = self.axlecast("web", "--log", self.write("no log", "text.lcm"), "--port", "0")
        self.assertEqual(code, 1)
        self.assertIn("contains no message", err)


if __name__ == "__main__":
    unittest.main()
