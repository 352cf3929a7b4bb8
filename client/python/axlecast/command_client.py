"""Sends commands to the bridge and follows each one to its outcome. Needs the package python3-nacl.

    from axlecast.command import CommandRequest, Outcome
    from axlecast.command_client import CommandClient

    with CommandClient(machine="press1", key_file="/etc/axlecast/plc.key", bridge_key="5f0c…") as client:
        result = client.execute(CommandRequest("axis1", "zero_single_turn", reason="shift change"))
        if result.outcome is Outcome.DONE: ...

Within asyncio: `result = await client.finish(client.send(request))`. A client belongs to one thread, and is active only within its methods.
"""

from __future__ import annotations

import asyncio
import dataclasses
import os
import secrets
import time
from collections.abc import Callable
from typing import Self

from axlecast import command_status_t, command_t
from axlecast.command import STATES, CommandRequest, CommandResult
from axlecast.command_session import CommandSession
from axlecast.origin import Origin
from axlecast.receiver import Receiver, Sender
from axlecast.signing import Keys
from axlecast.udpm import Message

DEFAULT_URL = "udpm://239.255.76.67:7668?ttl=0"

StatusCallback = Callable[[CommandResult], None]


class CommandClient:
    """A client of the bridge. A context manager: afterwards its sockets are closed. Commands that are under way continue at the bridge."""

    MAX_UNDER_WAY = 4_096

    def __init__(self, url: str = DEFAULT_URL, *, machine: str = "", prefix: str = "", key_file: str | os.PathLike | None = None,
                 bridge_key: str = "", on_status: StatusCallback | None = None) -> None:
        """`url`, `machine`, `prefix`: `lcm: command_url`, `machine` and `lcm: prefix` of the machine file. Statuses of other machines are
        ignored; without `machine`, those of all are accepted. `key_file`: the secret key that signs; without it, commands are unsigned.
        `bridge_key`: the bridge's public key, 64 hex digits; without it, every status is accepted. `on_status`: called for each new
        state and progress of the commands of this client (`under_way` is true), and once for the end of each.

        Raises ValueError if an argument or a key is not valid, and OSError if the group cannot be joined or a key cannot be read.
        """
        self._keys = Keys.load(key_file, bridge_key)
        self._origin = Origin(machine)
        self._on_status = on_status
        self._sessions: list[CommandSession] = []
        self._queries: set[CommandSession] = set()
        self._tasks = 0  # that wait in `finish`
        self._arrival: asyncio.Future[None] | None = None
        self._receiver = Receiver(url, prefix=prefix)
        try:
            self._sender = Sender(url, prefix=prefix)
        except OSError:
            self._receiver.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Closes the sockets."""
        self._receiver.close()
        self._sender.close()

    # -- commands

    def send(self, request: CommandRequest) -> CommandSession:
        """Begins a command and returns it; `result.id` identifies it, also for a later process. Continue with `wait` or `finish`; many may
        be under way. A request that does not fit into a command has ended at once."""
        if len(self._sessions) >= self.MAX_UNDER_WAY:
            raise ValueError(f"{self.MAX_UNDER_WAY} commands are under way: wait for some of them first")
        return self._begin(CommandSession(secrets.token_bytes(16), request, self._keys, time.monotonic_ns()))

    def execute(self, request: CommandRequest, timeout: float = 60.0) -> CommandResult:
        """Sends a command and waits for its outcome, at most `timeout` seconds."""
        return self.wait(self.send(request), timeout)

    def cancel(self, command: CommandSession) -> None:
        """Requests cancellation. The command still ends with its own outcome: wait for it."""
        command.cancel(time.monotonic_ns())
        self._poll(time.monotonic_ns())

    def query(self, command_id: bytes, timeout: float = 15.0) -> CommandResult:
        """Returns the state of the command of any client, also hours later. Needs no key."""
        return self.wait(self.send_query(command_id), timeout)

    def send_query(self, command_id: bytes) -> CommandSession:
        """Begins a query of a command of any client, for `finish`."""
        query = CommandSession(command_id, None, self._keys, time.monotonic_ns(), secrets.token_bytes(16))
        self._queries.add(query)
        return self._begin(query)

    def wait(self, command: CommandSession, timeout: float | None = None) -> CommandResult:
        """Waits for the outcome; after an INDETERMINATE, also for its finding. `timeout`: in seconds; None: as long as the bridge
        answers. If the time is over, the outcome is UNKNOWN and `under_way` is true: the command may still be executed. Wait again, or
        query its id. Do not send it again."""
        now = time.monotonic_ns()
        deadline = None if timeout is None else now + int(timeout * 1e9)
        while True:
            next_ns = self._poll(now)
            if command.done:
                return command.result
            if deadline is not None and now >= deadline:
                return _not_yet(command.result)
            until = next_ns if deadline is None else min(next_ns, deadline)
            for message in self._receiver.messages(max(0, until - now) / 1e9):
                self._take(message)
                break
            now = time.monotonic_ns()

    async def finish(self, command: CommandSession) -> CommandResult:
        """Waits for the outcome within asyncio. Several tasks may wait for commands of one client. If the task is cancelled, the command
        is not: call `cancel` for that."""
        loop = asyncio.get_running_loop()
        if self._tasks == 0:
            loop.add_reader(self._receiver, self._take_all)
        self._tasks += 1
        try:
            while True:
                now = time.monotonic_ns()
                next_ns = self._poll(now)
                if command.done:
                    return command.result
                if self._arrival is None or self._arrival.done():
                    self._arrival = loop.create_future()
                await asyncio.wait([self._arrival], timeout=max(0, next_ns - now) / 1e9)
        finally:
            self._tasks -= 1
            if self._tasks == 0:
                loop.remove_reader(self._receiver)

    # -- messages

    def _begin(self, command: CommandSession) -> CommandSession:
        self._sessions.append(command)
        self._poll(time.monotonic_ns())
        return command

    def _take_all(self) -> None:
        for message in self._receiver.messages(0):
            self._take(message)
        if self._arrival is not None and not self._arrival.done():
            self._arrival.set_result(None)

    def _take(self, message: Message) -> None:
        if message.channel != "COMMAND_STATUS":
            return
        status = self._receiver.decode(message)
        if not isinstance(status, command_status_t) or self._origin.is_foreign(status):
            return
        now = time.monotonic_ns()
        for command in list(self._sessions):  # a callback may add one
            if command.on_status(status, message.data, now) and not command.done:
                self._report(command, True)

    def _poll(self, now_ns: int) -> int:
        """Sends what is due and reports what has ended. Returns when it is due again."""
        for command in self._sessions:
            if (signed := command.next_message(now_ns)) is not None:
                self._publish(*signed)
        ended = [command for command in self._sessions if command.done]
        self._sessions = [command for command in self._sessions if not command.done]
        for command in ended:
            self._report(command, False)
        return min((command.next_ns() for command in self._sessions), default=now_ns)

    def _publish(self, body: bytes, signature: bytes) -> None:
        message = command_t()
        message.body, message.body_size, message.sig = body, len(body), signature
        self._origin.stamp(message, "COMMAND")
        self._sender.publish("COMMAND", message)

    def _report(self, command: CommandSession, under_way: bool) -> None:
        if command in self._queries:
            if not under_way:
                self._queries.discard(command)
        elif self._on_status is not None:
            self._on_status(dataclasses.replace(command.result, under_way=under_way))


def _not_yet(result: CommandResult) -> CommandResult:
    """What is known if the wait ended before the command."""
    if result.status is not None and result.status.is_final:
        return dataclasses.replace(result, under_way=True)  # its finding is still to come
    known = "no status came yet" if result.status is None else f"it is {STATES.get(result.status.state, 'unknown')} still"
    return dataclasses.replace(result, under_way=True, problem=known + ": it may be done until its validity ends; query this id later, and "
                               "do not send it again before")
