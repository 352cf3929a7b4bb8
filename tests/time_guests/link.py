"""The network cable between two guests: carries the Ethernet frames of QEMU's `-netdev stream`, which puts the length of a frame in
4 bytes before it. It can be cut, and it can delay the frames of one guest."""

import collections
import heapq
import selectors
import socket
import threading
import time


class Link:
    def __init__(self, folder, names):
        self.folder = folder
        self.addresses = {name: folder / f"link-{name}" for name in names}
        self.delay = dict.fromkeys(names, 0.0)  # s, of the frames that this guest sends
        self.carried = collections.Counter()
        self._up = True
        self._lock = threading.Lock()
        self._waiting = []  # (due, number, sender, bytes)
        self._number = 0
        self._peers = {}
        self._partial = {}
        self._selector = selectors.DefaultSelector()
        for name, address in self.addresses.items():
            listener = socket.socket(socket.AF_UNIX)
            listener.bind(str(address))
            listener.listen()
            self._selector.register(listener, selectors.EVENT_READ, (self._accept, name))
        threading.Thread(target=self._run, daemon=True).start()

    def cut(self):
        """From the return on, no frame leaves the cable."""
        with self._lock:
            self._up = False
            self._waiting.clear()

    def restore(self):
        with self._lock:
            self._up = True

    def _run(self):
        while True:
            with self._lock:
                pause = max(0.0, self._waiting[0][0] - time.monotonic()) if self._waiting else None
            for key, _ in self._selector.select(pause):
                function, name = key.data
                function(key.fileobj, name)
            with self._lock:
                while self._waiting and self._waiting[0][0] <= time.monotonic():
                    _, _, sender, frame = heapq.heappop(self._waiting)
                    self._deliver(sender, frame)

    def _accept(self, listener, name):
        """A guest that boots again connects again."""
        peer, _ = listener.accept()
        self._peers[name] = peer
        self._partial[name] = b""
        self._selector.register(peer, selectors.EVENT_READ, (self._receive, name))

    def _receive(self, peer, name):
        try:
            data = peer.recv(1 << 16)
        except ConnectionError:
            data = b""
        if not data:
            self._selector.unregister(peer)
            peer.close()
            if self._peers.get(name) is peer:
                del self._peers[name]
            return
        data = self._partial[name] + data
        with self._lock:
            while len(data) >= 4 and len(data) >= (size := 4 + int.from_bytes(data[:4], "big")):
                if self._up:
                    self._number += 1
                    heapq.heappush(self._waiting, (time.monotonic() + self.delay[name], self._number, name, data[:size]))
                data = data[size:]
        self._partial[name] = data

    def _deliver(self, sender, frame):
        for name, peer in self._peers.items():
            if name == sender:
                continue
            try:
                peer.sendall(frame)
                self.carried[sender] += 1
            except OSError:  # the guest ended
                pass
