"""The client's side of one command, without a socket and without a clock. The same rules as client/command/command_session.h.

It requests the state of its own new id: the answer contains the boot and the clock of the bridge. Then it repeats the command, each time the
same bytes, until a status answers them. It queries again if the bridge is silent. If the bridge restarts, it queries the id there. It never
sends a command under a second id: the device executes it at most once.
"""

from __future__ import annotations

import enum

from axlecast import command_body_t, command_status_t
from axlecast.command import STATES, CommandRequest, CommandResult, is_complete, query_body, signed_body
from axlecast.signing import Keys, digest, is_signed_by

_MS = 1_000_000  # ns
REPEAT_NS = 50 * _MS
ASK_NS = 500 * _MS  # without a status of an accepted command
NO_BRIDGE_NS = 3_000 * _MS  # without any answer, before anything was sent
SILENCE_NS = 10_000 * _MS  # without any answer: a bridge may be restarting
SETTLED_NS = 500 * _MS  # an unknown id of a new boot counts if the old boot and this session were silent for this time
FINDING_NS = 25_000 * _MS  # for the finding after an INDETERMINATE, which takes 20 s

_UNAUTHORIZED = "statuses come, but their signature does not fit the bridge key of the machine's file"


class _Phase(enum.Enum):
    LEARNING = enum.auto()  # the boot of the bridge
    SENDING = enum.auto()
    FOLLOWING = enum.auto()  # a status has answered the command
    ASKING = enum.auto()  # a new boot has appeared, which may have the command


class CommandSession:
    """A command that is under way, or the query of a command that another client has sent."""

    def __init__(self, command_id: bytes, request: CommandRequest | None, keys: Keys, now_ns: int, probe: bytes | None = None) -> None:
        """`command_id`: 16 random bytes. `request`: None queries the state of the command. `probe`: 16 random bytes, for a query.

        With the bridge's key, a query first requests the state of the probe: a status of the command before that answer is a replay.
        """
        self.result = CommandResult(command_id, prepare=request is not None and request.prepare)
        self.done = False
        self.unauthorized = 0  #: statuses for this id that the bridge's key has not signed
        self._request = request
        self._keys = keys
        self._probe = probe if request is None and keys.bridge is not None else None  # None: its answer has come
        self._phase = _Phase.LEARNING
        self._cancelling = False
        self._main: tuple[bytes, bytes] = (b"", b"")  # the command and its signature, as soon as the bridge is known
        self._digest = 0
        self._bridge_boot = 0
        self._former_boots: set[int] = set()  # their statuses are late
        self._bridge_seq = -1  # of the newest status that was followed
        self._bridge_mono_ns = 0  # in the newest status of the bridge
        self._received_ns = now_ns  # arrival of that status
        self._other_received_ns = now_ns  # arrival of the newest status of another boot
        self._main_sent_ns = 0
        self._final_ns = 0  # arrival of an INDETERMINATE
        self._next_send_ns = now_ns
        if request is not None and (problem := request.problem()):
            self._end_not_accepted(problem + ": nothing was sent")
            self.result.can_resend = False

    # -- sending

    def cancel(self, now_ns: int) -> None:
        """Requests cancellation. The command still ends with its own outcome."""
        if self._cancelling or self._request is None or self.done:
            return
        self._cancelling = True
        self._next_send_ns = now_ns
        if self._phase is not _Phase.LEARNING:
            return
        status = command_status_t()
        status.id, status.token, status.sig = self.result.id, bytes(16), bytes(64)
        status.device, status.operation = self._request.device, self._request.operation
        status.state, status.is_final, status.reason_code = status.STATE_CANCELLED, 1, status.REASON_CANCELLED
        status.text = "cancelled before it was sent"
        self.result.status = status
        self.done = True

    def next_message(self, now_ns: int) -> tuple[bytes, bytes] | None:
        """Returns the encoded command_body_t that is due, with its signature; None if nothing is."""
        self._end_if_hopeless(now_ns)
        if self.done or now_ns < self._next_send_ns:
            return None
        following = self._phase is _Phase.FOLLOWING
        self._next_send_ns = now_ns + (ASK_NS if following and not self._cancelling else REPEAT_NS)
        if self._phase is _Phase.SENDING:
            self._main_sent_ns = now_ns
            return self._main
        if following and self._cancelling:
            mono_ns = self._bridge_mono_ns + now_ns - self._received_ns
            return self._body(command_body_t.MODE_CANCEL, mono_ns)
        return query_body(self._probe or self.result.id)

    def next_ns(self) -> int:
        """Returns when next_message returns something, or ends the session, at the latest. Only while it is not done."""
        return min(self._next_send_ns, self._hopeless_ns())

    def _body(self, mode: int, bridge_mono_ns: int) -> tuple[bytes, bytes]:
        assert self._request is not None
        return signed_body(self.result.id, self._request, mode, self._bridge_boot, bridge_mono_ns, self._keys)

    # -- receiving

    def on_status(self, status: command_status_t, encoded: bytes, now_ns: int) -> bool:
        """Takes a status of any command, with its encoded bytes. Returns True if it is about this command and has something new."""
        if self.done or bytes(status.id) != (self._probe or self.result.id):
            return False
        if self._keys.bridge is not None and not is_signed_by(self._keys.bridge, encoded):
            self.unauthorized += 1
            return False
        if self._request is None:
            return self._on_queried(status, now_ns)
        if self._phase is _Phase.LEARNING:
            self._learn(status, now_ns)
            return False
        if _has_no_status(status):
            return False
        if status.boot_id != self._bridge_boot:
            return self._on_other_boot(status, now_ns)
        self._receive(status, now_ns)
        if status.body_digest == self._digest:
            return self._follow(status, now_ns)
        # The old boot is there after all: the other one did not belong here.
        if self._phase is _Phase.ASKING:
            self._phase = _Phase.SENDING if self.result.status is None else _Phase.FOLLOWING
        return False

    def _receive(self, status: command_status_t, now_ns: int) -> None:
        self._received_ns = now_ns
        self._bridge_mono_ns = status.mono_ns

    def _on_queried(self, status: command_status_t, now_ns: int) -> bool:
        if self._probe is not None:
            self._probe = None
            self._bridge_boot = status.boot_id
            self._receive(status, now_ns)
            self._next_send_ns = now_ns
            return False
        if self._keys.bridge is not None and (status.boot_id != self._bridge_boot or status.mono_ns < self._bridge_mono_ns):
            return False
        if _has_no_status(status):
            return False
        if status.state == status.STATE_UNKNOWN:
            self._end("the bridge does not know this id: it never accepted such a command, or no longer keeps it")
            return True
        self.result.status = status
        self.done = True
        if not status.is_final:
            self._end(f"it is {STATES.get(status.state, 'unknown')} still: query it later")
        return True

    def _learn(self, status: command_status_t, now_ns: int) -> None:
        assert self._request is not None
        self._bridge_boot = status.boot_id
        self._receive(status, now_ns)
        commit = command_body_t.MODE_COMMIT if self._request.token else command_body_t.MODE_EXECUTE
        self._main = self._body(command_body_t.MODE_PREPARE if self._request.prepare else commit, status.mono_ns)
        self._digest = digest(self._main[0])
        self._phase = _Phase.SENDING
        self._next_send_ns = now_ns

    def _on_other_boot(self, status: command_status_t, now_ns: int) -> bool:
        if status.boot_id in self._former_boots:
            return False
        self._other_received_ns = now_ns
        if status.body_digest == self._digest and not _is_stale(status):  # it has the journal with our command
            self._former_boots.add(self._bridge_boot)
            self._bridge_boot = status.boot_id
            self._bridge_seq = -1
            self._receive(status, now_ns)
            return self._follow(status, now_ns)
        # Two bridges may be there, and what was sent to the old one may be on its way.
        if self._phase is _Phase.ASKING and now_ns - max(self._received_ns, self._main_sent_ns) >= SETTLED_NS:
            self._end_not_taken_over()
            return False
        if self._phase is not _Phase.ASKING:
            self._next_send_ns = now_ns
        self._phase = _Phase.ASKING
        return False

    def _follow(self, status: command_status_t, now_ns: int) -> bool:
        before = self.result.status
        if self._is_late(status):
            return False
        self._bridge_seq = status.seq
        if not self._cancelling or self._phase is not _Phase.FOLLOWING:
            self._next_send_ns = now_ns + (0 if self._cancelling else ASK_NS)
        self._phase = _Phase.FOLLOWING
        self.result.status = status
        if status.is_final:
            self._final_ns = now_ns
        self.done = is_complete(status)
        return before is None or _content(before) != _content(status)

    def _is_late(self, status: command_status_t) -> bool:
        """An outcome is final, and a status that was sent before the newest one is late."""
        if status.seq < self._bridge_seq:
            return True
        return self._has_outcome() and (not status.is_final or status.finding == status.FINDING_NONE)

    def _has_outcome(self) -> bool:
        return self.result.status is not None and bool(self.result.status.is_final)

    # -- ending without an outcome

    def _hopeless_ns(self) -> int:
        limit = NO_BRIDGE_NS if self._phase is _Phase.LEARNING else SILENCE_NS
        silence = max(self._received_ns, self._other_received_ns) + limit + 1
        return min(silence, self._final_ns + FINDING_NS) if self._has_outcome() else silence

    def _end_if_hopeless(self, now_ns: int) -> None:
        if self.done or now_ns < self._hopeless_ns():
            return
        if self._has_outcome():
            self.done = True  # an INDETERMINATE whose finding did not come
        elif self._phase is not _Phase.LEARNING:
            cause = _UNAUTHORIZED if self.unauthorized else "the bridge fell silent"
            self._end(cause + ": query this id later, and check the device")
        elif self.unauthorized:
            self._end_not_accepted(_UNAUTHORIZED + " (bridge: key: public): put the public key of the bridge there; nothing was sent")
        else:
            self._end_not_accepted("no bridge answers on the command port: start axlecast-bridge (or axlecast up); nothing was sent")

    def _end_not_taken_over(self) -> None:
        if self._has_outcome():
            self.done = True  # an INDETERMINATE; its finding cannot come any more
        elif self.result.status is not None:
            self._end("the bridge restarted, and its journal does not contain this command any more: check the device before you send "
                      "it again")
        else:
            self._end_not_accepted("the bridge restarted and never accepted it: nothing was done; send it again")

    def _end(self, problem: str) -> None:
        self.result.problem = problem
        self.done = True

    def _end_not_accepted(self, problem: str) -> None:
        """A query does not show whether a command was accepted."""
        self.result.not_accepted = self.result.can_resend = self._request is not None
        self._end(problem)


def _content(status: command_status_t) -> tuple:
    return status.state, status.finding, status.progress, status.text


def _has_no_status(status: command_status_t) -> bool:
    """The answer of a bridge that cannot read its journal: it has the boot id, but no status of the command."""
    return status.state == status.STATE_UNKNOWN and status.reason_code == status.REASON_JOURNAL


def _is_stale(status: command_status_t) -> bool:
    """The answer of a boot of the bridge for which the command was not meant."""
    return status.state == status.STATE_REJECTED and status.reason_code == status.REASON_STALE_BRIDGE
