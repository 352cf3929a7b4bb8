"""A server of the page with a made-up machine, for what a real one cannot be asked to do: to fall silent, to go away, to
speak nonsense. The protocol is that of docs/web_protocol.md; HTTP and WebSocket are just enough for one browser."""

import asyncio
import base64
import hashlib
import json
import math
import pathlib
import struct
import threading
import time

TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml",
         ".woff2": "font/woff2", ".txt": "text/plain"}
POLICY = ("default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
          "font-src 'self'; form-action 'self'; base-uri 'none'; frame-ancestors 'none'")
GUID = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11"  # RFC 6455, 1.3
POSITION_COLUMNS = [{"name": "value", "unit": "mm"}, {"name": "turns", "unit": "turn"}, {"name": "speed_rpm", "unit": "rpm"}]


def now_us():
    return time.time_ns() // 1000


class FakeServer:
    """Serves from a thread of its own: url, then `say`(frame), silence(), hang_up(code), close()."""

    def __init__(self, folders, devices=("axis1", "axis2")):
        self.folders = [pathlib.Path(folder) for folder in folders]
        self.devices = devices
        self.talking = True
        self.heard = []  # frames from the page
        self.speakers = {}  # by the writer of their connection
        self.loop = asyncio.new_event_loop()
        self.thread = threading.Thread(target=self.loop.run_forever, daemon=True)
        self.thread.start()
        self.server = self._run(asyncio.start_server(self._serve, "127.0.0.1", 0))
        self.port = self.server.sockets[0].getsockname()[1]
        self.url = f"http://127.0.0.1:{self.port}/"

    def _run(self, what):
        return asyncio.run_coroutine_threadsafe(what, self.loop).result(20)

    def silence(self):
        self.talking = False

    def speak(self):
        self.talking = True

    def say(self, frame):
        text = frame if isinstance(frame, str) else json.dumps(frame)
        self._run(self._to_all(framed(1, text.encode())))

    def hang_up(self, code):
        """Nothing may follow a close frame (RFC 6455, 5.5.1)."""
        async def close():
            for writer, speaker in self.speakers.items():
                speaker.cancel()
                writer.write(framed(8, struct.pack("!H", code)))
        self._run(close())

    def stop_listening(self):
        """Like a server that is gone: no new connection, the old ones cut."""
        async def stop():
            self.server.close()
            for writer in self.speakers:
                writer.transport.abort()
        self._run(stop())

    def listen_again(self):
        self.server = self._run(asyncio.start_server(self._serve, "127.0.0.1", self.port))

    def close(self):
        self.stop_listening()
        self.loop.call_soon_threadsafe(self.loop.stop)
        self.thread.join(20)
        self.loop.close()

    async def _to_all(self, data):
        for writer in self.speakers:
            writer.write(data)

    async def _serve(self, reader, writer):
        try:
            head = (await reader.readuntil(b"\r\n\r\n")).decode("latin-1")
            fields = dict(line.split(": ", 1) for line in head.split("\r\n")[1:] if ": " in line)
            path = head.split(" ")[1]
            if path == "/ws":
                await self._talk(reader, writer, fields)
            else:
                writer.write(self._file("index.html" if path == "/" else path[1:]))
                await writer.drain()
        except (ConnectionError, asyncio.IncompleteReadError):
            pass
        finally:
            writer.close()

    def _file(self, name):
        for folder in self.folders:
            if "/" not in name and (folder / name).is_file():
                body = (folder / name).read_bytes()
                kind = TYPES[pathlib.Path(name).suffix]
                return (f"HTTP/1.1 200 OK\r\nContent-Type: {kind}\r\nContent-Length: {len(body)}\r\n"
                        f"Content-Security-Policy: {POLICY}\r\nConnection: close\r\n\r\n").encode() + body
        return b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"

    async def _talk(self, reader, writer, fields):
        answer = base64.b64encode(hashlib.sha1((fields["Sec-WebSocket-Key"] + GUID).encode()).digest()).decode()
        writer.write((f"HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                      f"Sec-WebSocket-Accept: {answer}\r\nSec-WebSocket-Protocol: axlecast-web-1\r\n\r\n").encode())
        self.speakers[writer] = asyncio.ensure_future(self._speak(writer))
        try:
            while True:
                kind, payload = await read_frame(reader)
                if kind == 8:
                    return
                if kind == 1:
                    self.heard.append(json.loads(payload))
        finally:
            self.speakers.pop(writer).cancel()

    async def _speak(self, writer):
        writer.write(framed(1, json.dumps(self.hello()).encode()))
        for device in self.devices:
            writer.write(framed(1, json.dumps(alarms(device, [], [])).encode()))
        while True:
            if self.talking:
                writer.write(framed(1, json.dumps(self.state()).encode()))
                for frame in self.samples():
                    writer.write(framed(1, json.dumps(frame).encode()))
                await writer.drain()
            await asyncio.sleep(0.1)

    def hello(self):
        return {"type": "hello", "version": "0", "machine": "made up", "mode": "live", "history_s": 60, "log": None,
                "buses": [{"bus": "rs485-0", "family": "tformat", "port": "/dev/x", "simulated": True, "devices": list(self.devices)}],
                "devices": [{"device": device, "bus": "rs485-0", "family": "tformat", "model": "ts5669n127", "kind": "position",
                             "unit": "mm", "per_turn": 5, "columns": POSITION_COLUMNS} for device in self.devices]}

    def state(self):
        t = now_us()
        return {"type": "state", "utime": t, "recorders": [], "bridge": {"serves": True, "heard_utime": t},
                "devices": [{"device": device, "state": "ONLINE", "reason": "", "heard_utime": t, "model": "ts5669n127", "serial": "",
                             "firmware": "", "identity": 17, "rate_hz": 100.0, "lost": 0, "good": 1, "errors": {}, "alarms": 0,
                             "worst": None, "max_age_us": 20000, "reading": reading(t)} for device in self.devices],
                "buses": [{"bus": "rs485-0", "state": "UP", "heard_utime": t, "exchanges": 10, "good": 10, "errors": {}, "late": 0,
                           "rx_dropped": 0, "rate_hz": 1000.0, "wire_limit_hz": 19608.0, "utilisation": 0.05,
                           "exchange_us": {"min": 51, "p50": 60, "p99": 90, "max": 300}, "reopens": 0, "can_tec": None,
                           "can_rec": None, "last_error": "", "last_error_utime": None}]}

    def samples(self):
        wanted = next((frame["devices"] for frame in reversed(self.heard) if frame["type"] == "subscribe"), [])
        start = now_us() // 100000 * 100000 - 100000
        for device in wanted:
            times = [start + 10000 * i for i in range(10)]
            readings = [reading(t) for t in times]
            yield {"type": "samples", "device": device, "t0_utime": start, "dt_us": [t - start for t in times], "dropped": 0,
                   "columns": {name: [each[name] for each in readings] for name in ("value", "turns", "speed_rpm")}}


def reading(t):
    """A shaft that swings by 50 mm once in 4 s."""
    phase = 2 * math.pi * (t % 4000000) / 4e6
    return {"utime": t, "age_us": 5000, "stale": False, "valid": True, "flags": ["valid", "simulated"], "unit": "mm",
            "value": 50 * math.sin(phase), "turns": 10 * math.sin(phase), "angle_deg": 3600 * math.sin(phase) % 360,
            "speed_rpm": 942.5 * math.cos(phase), "raw_counts": 1, "raw_turns": 1, "counts": 1, "datum_epoch": 0, "device_status": 0}


def alarms(device, entries, appeared):
    return {"type": "alarms", "device": device, "utime": now_us(), "total": len(entries), "entries": entries,
            "appeared": appeared, "cleared": []}


def trip(device, count, power):
    """One curve of 20 samples, 1 s apart."""
    return {"type": "trip", "device": device, "utime": now_us(), "log_index": 0, "trip_count": count, "factors": [], "factor_names": [],
            "not_before_utime": None, "not_after_utime": 1790000000000000 + count, "interval_us": 1000000,
            "quantities": [{"name": "power_w", "unit": "W"}], "samples": [[power * i for i in range(20)]]}


def framed(kind, payload):
    """One unmasked frame, RFC 6455 5.2."""
    if len(payload) < 126:
        return bytes([0x80 | kind, len(payload)]) + payload
    if len(payload) < 65536:
        return struct.pack("!BBH", 0x80 | kind, 126, len(payload)) + payload
    return struct.pack("!BBQ", 0x80 | kind, 127, len(payload)) + payload


async def read_frame(reader):
    first, second = await reader.readexactly(2)
    length = second & 0x7F
    if length == 126:
        length = int.from_bytes(await reader.readexactly(2), "big")
    elif length == 127:
        length = int.from_bytes(await reader.readexactly(8), "big")
    mask = await reader.readexactly(4)
    payload = await reader.readexactly(length)
    return first & 0x0F, bytes(byte ^ mask[i % 4] for i, byte in enumerate(payload))
