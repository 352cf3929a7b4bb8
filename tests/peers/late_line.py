"""A serial line on a pty whose devices answer late, twice, not at all, or with garbage, as the test specifies. Requests and replies
take their time on the wire. Nothing here comes from axlecast's code.

A line's `station` is what listens on it. size(begin) returns how many bytes the request has that begins so, 0 while that is
open. whose(request) returns what tells its device from the others. answer(request, now) returns the reply with the sample
taken at `now`, or None."""

import heapq
import os
import pty
import random
import select
import threading
import time
import tty

LOST_NS = 50_000_000  # the rest of a request is dropped after this time


class Behaviour:
    """What happens to a reply. `share` of them are late by up to `longest_ns`; of those some are sampled late as well, the others
    held back on their way. One cable keeps the order of all its replies; where each device has a way of its own (`own_ways`) the
    reply of one may overtake that of another."""

    def __init__(self, share=0.0, longest_ns=0, silent=0.0, garbage=0.0, twice=0.0, own_ways=False, seed=1):
        self.share, self.longest_ns, self.silent, self.garbage, self.twice = share, longest_ns, silent, garbage, twice
        self.own_ways = own_ways
        self.random = random.Random(seed)

    def delays(self):
        """ns before the sample, ns after it."""
        if self.random.random() >= self.share:
            return 0, 0
        delay = int(self.random.random() * self.longest_ns)
        before = int(delay * self.random.random()) if self.random.random() < 0.3 else 0
        return before, delay - before

    def bytes_of(self, reply):
        """What comes in the reply's place; empty: nothing."""
        chance = self.random.random()
        if chance < self.silent:
            return b""
        if chance < self.silent + self.garbage:
            return self.random.randbytes(len(reply))
        return 2 * reply if chance < self.silent + self.garbage + self.twice else reply


class LateLine:
    """`path` is for our program. `within_ns`: a reply that this process could not deliver so soon after its request is lost, so
    that a busy host does not break what the test promises."""

    def __init__(self, station, character_ns, behaviour, within_ns):
        self.requests = 0
        self.lost = 0
        self._station, self._character_ns, self._behaviour, self._within_ns = station, character_ns, behaviour, within_ns
        self._master, self._slave = pty.openpty()
        tty.setraw(self._slave)  # and kept open: a pty without one gives EIO
        self.path = os.ttyname(self._slave)
        self._events = []  # (due ns, order, what to do)
        self._order = 0
        self._last_sample = {}  # of a device: it answers one request after the other
        self._last_reply = {}  # of a way
        self._stop, self._stopper = os.pipe()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self):
        os.close(self._stopper)
        self._thread.join()
        for descriptor in (self._stop, self._master, self._slave):
            os.close(descriptor)

    def _at(self, due, action):
        self._order += 1
        heapq.heappush(self._events, (due, self._order, action))

    def _run(self):
        heard, heard_at = b"", 0
        asleep = time.monotonic_ns()  # nothing that is read now was written before
        while True:
            wait = 0.01
            if self._events:
                wait = min(wait, max(0.0, (self._events[0][0] - time.monotonic_ns()) / 1e9))
            ready, _, _ = select.select([self._master, self._stop], [], [], wait)
            if self._stop in ready:
                return
            now = time.monotonic_ns()
            if self._master in ready:
                if now - heard_at > LOST_NS:
                    heard = b""
                heard, heard_at = self._take(heard + os.read(self._master, 4096), asleep, now), now
            asleep = now
            while self._events and self._events[0][0] <= time.monotonic_ns():
                heapq.heappop(self._events)[2]()

    def _take(self, heard, written, now):
        """Returns what is left: the begin of a request. `written`: no request was sent earlier."""
        while heard:
            size = self._station.size(heard)
            if size == 0 or len(heard) < size:
                break
            request, heard = heard[:size], heard[size:]
            self.requests += 1
            before, after = self._behaviour.delays()
            device = self._station.whose(request)
            due = max(now + size * self._character_ns + before, self._last_sample.get(device, 0) + 1)
            self._last_sample[device] = due
            self._at(due, lambda request=request, after=after: self._answer(request, written, after))
        return heard

    def _answer(self, request, written, after):
        now = time.monotonic_ns()
        reply = self._station.answer(request, now)
        if reply is None:
            return
        data = self._behaviour.bytes_of(reply)
        way = self._station.whose(request) if self._behaviour.own_ways else None
        due = max(now + len(reply) * self._character_ns + after, self._last_reply.get(way, 0))
        self._last_reply[way] = due
        if data:
            self._at(due, lambda: self._deliver(data, written))

    def _deliver(self, data, written):
        if time.monotonic_ns() - written > self._within_ns:
            self.lost += 1
            return
        os.write(self._master, data)


class LateStream(LateLine):
    """An encoder that sends by itself, once a period. Its cable stalls now and then for up to `longest_ns`; then everything comes
    at once, in a piece for each frame. `frame(now)` returns the frame of a sample taken at `now`. `requests` counts frames."""

    PIECE_S = 0.0005  # so that the driver reads every piece

    def __init__(self, frame, period_ns, character_ns, behaviour):
        self._frame, self._period_ns = frame, period_ns
        self._clear_at = 0  # the end of the stall
        super().__init__(None, character_ns, behaviour, 0)

    def _run(self):
        due = time.monotonic_ns()
        held = []
        while not select.select([self._stop], [], [], max(0.0, (due - time.monotonic_ns()) / 1e9))[0]:
            now = time.monotonic_ns()
            self.requests += 1
            frame = self._behaviour.bytes_of(self._frame(now))
            time.sleep(len(frame) * self._character_ns / 1e9)
            held.append(frame)
            if now >= self._clear_at:
                for piece in held:
                    os.write(self._master, piece)
                    time.sleep(self.PIECE_S)
                held.clear()
                if self._behaviour.random.random() < self._behaviour.share:
                    self._clear_at = now + int(self._behaviour.random.random() * self._behaviour.longest_ns)
            due = now + self._period_ns  # an encoder does not make up for lost time
