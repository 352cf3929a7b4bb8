"""A serial cable between our program and a peer: two ptys and a thread that carries bytes both ways. It notes when what
passed, and can hold back or cut off what comes from the peer."""

import heapq
import os
import pty
import select
import threading
import time
import tty


class Cable:
    """`host` is the tty for our program, `peer` the one for the other side."""

    def __init__(self):
        self.delay = lambda data: 0.0  # s, of what the peer sends; None: lost
        self.passed = []  # (monotonic s, "host" or "peer" as the sender, bytes)
        self._ends = [pty.openpty(), pty.openpty()]
        for _, slave in self._ends:
            tty.setraw(slave)  # and kept open: a pty without one gives EIO
        self.host, self.peer = (os.ttyname(slave) for _, slave in self._ends)
        self._stop, self._stopper = os.pipe()
        self._thread = threading.Thread(target=self._carry, daemon=True)
        self._thread.start()

    def close(self):
        os.close(self._stopper)
        self._thread.join()
        os.close(self._stop)
        for end in self._ends:
            for descriptor in end:
                os.close(descriptor)

    def _carry(self):
        host, peer = (master for master, _ in self._ends)
        held = []  # (due, order, bytes) for the host
        order = 0
        while True:
            wait = max(0.0, held[0][0] - time.monotonic()) if held else None
            ready, _, _ = select.select([host, peer, self._stop], [], [], wait)
            if self._stop in ready:
                return
            now = time.monotonic()
            if host in ready:
                data = os.read(host, 4096)
                self.passed.append((now, "host", data))
                os.write(peer, data)
            if peer in ready:
                data = os.read(peer, 4096)
                self.passed.append((now, "peer", data))
                delay = self.delay(data)
                if delay is not None:
                    order += 1
                    heapq.heappush(held, (now + delay, order, data))
            while held and held[0][0] <= time.monotonic():
                os.write(host, heapq.heappop(held)[2])
