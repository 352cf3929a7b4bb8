"""Brokers for the tests of `axlecast mqtt`: Debian's mosquitto, relays before it that cut, stall or slow down, and
mosquitto_sub, which is not ours, as the one who listens."""

import json
import select
import socket
import subprocess
import threading
import time

from machine import BIN, Machine, wait_for

PORT = 1883
RELAY_PORT = 1893


class Subscriber:
    """Every message of the topics below `topic`, in order of arrival: mosquitto_sub in the background."""

    def __init__(self, *options, topic="#", port=PORT):
        self.messages = []
        self.lock = threading.Lock()
        # The subscription is in force when what was published after it has come back.
        self.process = subprocess.Popen(["mosquitto_sub", "-p", str(port), "-q", "1", "-t", topic, "-F", "%j", *options],
                                        stdout=subprocess.PIPE, text=True)
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _read(self):
        for line in self.process.stdout:
            if line.endswith("\n"):
                with self.lock:
                    self.messages.append(json.loads(line))

    def of(self, topic):
        """The payloads of a topic."""
        with self.lock:
            return [json.loads(m["payload"]) for m in self.messages if m["topic"] == topic and m["payload"]]

    def topics(self):
        with self.lock:
            return {m["topic"] for m in self.messages}

    def last(self, topic):
        return next(iter(self.of(topic)[-1:]), None)

    def close(self):
        self.process.kill()
        self.process.wait()
        self.reader.join()
        self.process.stdout.close()


class Relay:
    """A TCP relay before the broker. `mode`: "pass"; "refuse" closes what comes; "stall" takes connections and is silent;
    or bytes per second towards the broker."""

    def __init__(self, port=RELAY_PORT, target=PORT):
        self.links = []
        self.mode = "pass"
        self.target = target
        self.listener = socket.socket()
        self.listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.listener.bind(("127.0.0.1", port))
        self.listener.listen()
        self.accepted = 0
        self.acceptor = threading.Thread(target=self._accept, daemon=True)
        self.acceptor.start()

    @property
    def mode(self):
        return self._mode

    @mode.setter
    def mode(self, mode):
        self._mode = mode
        for link in self.links:
            self._set_window(link)

    def _set_window(self, link):
        """A small window, so that a slow broker is felt; a wide one else: TCP passes 4 kB in 200 ms through a small one."""
        try:
            link.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096 if isinstance(self._mode, int) else 1 << 18)
        except OSError:
            pass  # it has ended

    def _accept(self):
        while True:
            try:
                client, _ = self.listener.accept()
            except OSError:
                return
            self.accepted += 1
            if self.mode == "refuse":
                client.close()
                continue
            self.links.append(client)
            if self.mode == "stall":
                continue
            self._set_window(client)
            try:
                broker = socket.create_connection(("127.0.0.1", self.target))
            except OSError:
                client.close()
                continue
            self.links.append(broker)
            threading.Thread(target=self._carry, args=(client, broker), daemon=True).start()

    def _carry(self, client, broker):
        try:
            while True:
                for source in select.select([client, broker], [], [])[0]:
                    data = source.recv(512 if isinstance(self.mode, int) else 65536)
                    if not data:
                        raise OSError
                    if source is client and isinstance(self.mode, int):
                        time.sleep(len(data) / self.mode)
                    (broker if source is client else client).sendall(data)
        except (OSError, ValueError):
            client.close()
            broker.close()

    def cut(self, mode="refuse"):
        """Ends the connections; from now on `mode`."""
        self.mode = mode
        links, self.links = self.links, []
        for link in links:
            try:
                link.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass
            link.close()

    def close(self):
        self.listener.shutdown(socket.SHUT_RDWR)  # ends the waiting accept, which would keep the port
        self.acceptor.join()
        self.listener.close()
        self.cut()


class MqttMachine(Machine):
    """Base of the tests: brokers, and machines that publish to them."""

    def setUp(self):
        super().setUp()
        self.brokers = 0

    def broker(self, *lines, port=PORT, wait=True):
        """A mosquitto on loopback."""
        self.brokers += 1
        listener = "" if any(line.startswith("listener") for line in lines) else f"listener {port} 127.0.0.1\n"
        access = "" if any(line.startswith("allow_anonymous") for line in lines) else "allow_anonymous true\n"
        # A subscriber that is slow on a busy machine shall not lose what the broker has.
        user = "user root\nmax_queued_messages 0\nmax_inflight_messages 0\n"
        config = self.write(listener + access + user + "\n".join(lines) + "\n", f"broker{self.brokers}.conf")
        process = self.start("broker", "mosquitto", "-c", config)
        if wait:
            wait_for(lambda: self.listens(port) or process.poll() is not None, "the broker to listen")
            self.assertIsNone(process.poll(), self.log("broker"))
        return process

    @staticmethod
    def listens(port):
        with socket.socket() as probe:
            return probe.connect_ex(("127.0.0.1", port)) == 0

    def relay(self):
        relay = Relay()
        self.addCleanup(relay.close)
        return relay

    def subscribe(self, *options, **names):
        subscriber = Subscriber(*options, **names)
        self.addCleanup(subscriber.close)
        return subscriber

    def mqtt(self, *options, name="mqtt", env=None):
        return self.start(name, BIN / "axlecast", "mqtt", self.config, *options, env=env)

    def wait_connected(self, times=1, name="mqtt"):
        wait_for(lambda: self.log(name).count(": connected") >= times, lambda: "a connection: " + self.log(name))

    def end(self, process):
        """Its exit code after SIGINT."""
        process.send_signal(2)
        return process.wait(30)


def gaps(payloads):
    """How many messages of one topic are missing between the first and the last, by their numbers; fails when they are
    out of order. The same one may come twice."""
    numbers = [payload["publication"] for payload in payloads]
    unique = list(dict.fromkeys(numbers))
    assert unique == sorted(unique), unique
    return unique[-1] - unique[0] + 1 - len(unique) if unique else 0
