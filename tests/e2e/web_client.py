"""A browser's half of HTTP and of the WebSocket protocol (RFC 6455), plain enough to break their rules."""

import base64
import json
import os
import socket
import ssl
import struct

from machine import LIMIT

TEXT, BINARY, CLOSE, PING, PONG = 1, 2, 8, 9, 10


class Closed(Exception):
    """The server ended the connection; `code` as it sent it, None without a close frame."""

    def __init__(self, code):
        super().__init__(f"closed: {code}")
        self.code = code


class Link:
    """A connection to the server, and what was read of it too far."""

    def __init__(self, port, tls=None, receive_buffer=None, address="127.0.0.1", source=None):
        self.socket = socket.socket(socket.AF_INET)
        if receive_buffer:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        self.socket.settimeout(LIMIT)
        if source:
            self.socket.bind((source, 0))
        self.socket.connect((address, port))
        if tls:
            self.socket = tls.wrap_socket(self.socket, server_hostname="localhost")
        self.rest = b""

    def close(self):
        self.socket.close()

    def send(self, data):
        self.socket.sendall(data)

    def read(self, size):
        while len(self.rest) < size:
            part = self.socket.recv(65536)
            if not part:
                raise Closed(None)
            self.rest += part
        data, self.rest = self.rest[:size], self.rest[size:]
        return data

    def read_head(self):
        """Status and headers, whose names are in lower case."""
        head = b""
        while not head.endswith(b"\r\n\r\n"):
            head += self.read(1)
        status, *lines = head.decode().split("\r\n")
        pairs = [line.split(":", 1) for line in lines if line]
        return int(status.split()[1]), {name.lower(): value.strip() for name, value in pairs}


def tls_trusting(certificate):
    return ssl.create_default_context(cafile=str(certificate))


def request(port, path, method="GET", headers=None, body=b"", tls=None, address="127.0.0.1"):
    """Status, headers and body of one answer."""
    link = Link(port, tls, address=address)
    try:
        fields = {"Host": f"localhost:{port}", "Connection": "close", **(headers or {})}
        if body:
            fields["Content-Length"] = len(body)
        lines = "".join(f"{name}: {value}\r\n" for name, value in fields.items())
        link.send(f"{method} {path} HTTP/1.1\r\n{lines}\r\n".encode() + body)
        status, answer = link.read_head()
        size = int(answer.get("content-length", 0))
        return status, answer, link.read(size) if method != "HEAD" and status != 304 else b""
    finally:
        link.close()


class WebSocket:
    """Open when it has been made; else `status` is the reason."""

    def __init__(self, port, headers=None, tls=None, path="/ws", protocol="axlecast-web-1", receive_buffer=None):
        self.link = Link(port, tls, receive_buffer)
        key = base64.b64encode(os.urandom(16)).decode()
        fields = {"Host": f"localhost:{port}", "Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Key": key,
                  "Sec-WebSocket-Version": "13", "Sec-WebSocket-Protocol": protocol, **(headers or {})}
        lines = "".join(f"{name}: {value}\r\n" for name, value in fields.items())
        self.link.send(f"GET {path} HTTP/1.1\r\n{lines}\r\n".encode())
        self.status, self.headers = self.link.read_head()
        if self.status != 101:
            self.link.close()

    def close(self):
        self.link.close()

    def send_frame(self, data, opcode=TEXT, final=True, masked=True):
        length = bytes([len(data)]) if len(data) < 126 else struct.pack(">BH", 126, len(data)) if len(data) < 65536 else \
            struct.pack(">BQ", 127, len(data))
        mask = os.urandom(4) if masked else b""
        if masked:
            length = bytes([length[0] | 0x80]) + length[1:]
            data = bytes(byte ^ mask[i % 4] for i, byte in enumerate(data))
        self.link.send(bytes([(0x80 if final else 0) | opcode]) + length + mask + data)

    def ask(self, **fields):
        self.send_frame(json.dumps(fields).encode())

    def receive(self):
        """The next frame's object; answers pings."""
        text = b""
        while True:
            first, second = self.link.read(2)
            size = second & 0x7F
            if size >= 126:
                size = int.from_bytes(self.link.read(2 if size == 126 else 8), "big")
            data = self.link.read(size)
            opcode = first & 0x0F
            if opcode == CLOSE:
                raise Closed(int.from_bytes(data[:2], "big") if data else None)
            if opcode == PING:
                self.send_frame(data, PONG)
            if opcode in (0, TEXT):
                text += data
                if first & 0x80:
                    return json.loads(text)

    def until(self, matches, most=100_000):
        """The first frame that matches, and all before it."""
        before = []
        for _ in range(most):
            frame = self.receive()
            if matches(frame):
                return frame, before
            before.append(frame)
        raise AssertionError(f"not among {most} frames")

    def closed(self):
        """The code with which the server ends it."""
        try:
            while True:
                self.receive()
        except Closed as end:
            return end.code
        except ConnectionError:
            return None
