"""What a command requests, and how it ended. docs/commands.md has the operations, states and reasons."""

from __future__ import annotations

import dataclasses
import enum

from axlecast import argument_t, command_body_t, command_status_t
from axlecast.signing import COMMAND, Keys, key_id, sign

_MAX_BODY = 1_200  # bytes, command_t.body_size
_MAX_ARGUMENTS = 16
_MAX_REASON = 160  # bytes
_MAX_VALID_MS = 3_600_000


def _names(prefix: str) -> dict[int, str]:
    """The words of the constants of command_status_t that begin with the prefix, by their numbers."""
    return {number: name.removeprefix(prefix).lower() for name, number in vars(command_status_t).items() if name.startswith(prefix)}


STATES = _names("STATE_")
REASONS = _names("REASON_")
FINDINGS = _names("FINDING_")

_TEMPORARY = frozenset(("stale_bridge", "queue_full", "busy", "driver_absent", "not_standing_still", "no_permit", "device_offline",
                        "journal", "deadline", "stopping", "moved_during_sequence", "fenced", "bridge_restarted"))


@dataclasses.dataclass(frozen=True, slots=True)
class CommandRequest:
    """A command that an operator or a program sends."""

    device: str
    operation: str
    arguments: dict[str, str] = dataclasses.field(default_factory=dict)
    """At most 16."""
    valid_ms: int = 5_000
    """It may begin within this time, 1 to 3600000."""
    expect_epoch: int = -1
    """It is refused if the datum_epoch of the device differs. -1: any."""
    reason: str = ""
    """For the journal, at most 160 bytes."""
    prepare: bool = False
    """Only report what would happen. The result then has a token."""
    token: bytes | None = None
    """Do what was prepared: with the same device, operation and arguments."""

    def problem(self) -> str:
        """Returns why it does not fit into a command; empty if it does. Nothing is truncated."""
        texts = [self.device, self.operation, self.reason, *self.arguments, *self.arguments.values()]
        if not 1 <= self.valid_ms <= _MAX_VALID_MS:
            return f"valid_ms is {self.valid_ms}: give 1 to 3600000"
        if len(self.arguments) > _MAX_ARGUMENTS:
            return "it has more than 16 arguments"
        if len(self.reason.encode()) > _MAX_REASON:
            return "its reason is longer than 160 bytes"
        if self.prepare and self.token:
            return "it prepares and commits at once: send the token without prepare"
        if self.token is not None and len(self.token) != 16:
            return "its token has not 16 bytes"
        if any("\0" in text for text in texts):
            return "one of its texts contains a NUL byte"
        if len(encode_body(bytes(16), self, command_body_t.MODE_EXECUTE)) > _MAX_BODY:
            return "its texts are longer than a command: 1200 bytes in all"
        return ""


class Outcome(enum.Enum):
    """How a command ended."""

    DONE = "done, and read back"
    DONE_UNVERIFIED = "the device confirmed it, but allows no read-back"
    PREPARED = "it would be done; nothing was done"
    REJECTED = "nothing was done"
    EXPIRED = "nothing was done: it could not begin in time"
    CANCELLED = "nothing was done: it was cancelled"
    FAILED = "it may have been done in part: check the device"
    INDETERMINATE = "the effect is not known: see the finding, and check the device"
    NOT_ACCEPTED = "no bridge has accepted it: nothing was done"
    UNKNOWN = "no outcome is known yet: query the id later, do not send it again"


_OUTCOMES = {command_status_t.STATE_REJECTED: Outcome.REJECTED, command_status_t.STATE_EXPIRED: Outcome.EXPIRED,
             command_status_t.STATE_CANCELLED: Outcome.CANCELLED, command_status_t.STATE_FAILED: Outcome.FAILED,
             command_status_t.STATE_INDETERMINATE: Outcome.INDETERMINATE}


@dataclasses.dataclass(slots=True)
class CommandResult:
    """What is known of a command."""

    id: bytes
    status: command_status_t | None = None
    """The newest status from the bridge."""
    problem: str = ""
    """Why no outcome is known, and what to do; empty if one is."""
    not_accepted: bool = False
    """No bridge has it, and none will under this id: nothing was done."""
    can_resend: bool = False
    """With not_accepted: the command itself was not the cause."""
    prepare: bool = False
    under_way: bool = False
    """The command has not ended: it is still followed, and can be awaited again."""

    @property
    def outcome(self) -> Outcome:
        """How it ended, as far as that is known."""
        if self.not_accepted:
            return Outcome.NOT_ACCEPTED
        if self.status is None or not self.status.is_final:
            return Outcome.UNKNOWN
        if self.status.state == command_status_t.STATE_SUCCEEDED:
            if self.prepare:
                return Outcome.PREPARED
            return Outcome.DONE if self.status.verified else Outcome.DONE_UNVERIFIED
        return _OUTCOMES.get(self.status.state, Outcome.UNKNOWN)

    @property
    def temporary(self) -> bool:
        """Nothing was done, and the same request may be accepted later."""
        if self.outcome is Outcome.NOT_ACCEPTED:
            return self.can_resend
        return self.outcome in (Outcome.REJECTED, Outcome.EXPIRED) and self.reason in _TEMPORARY

    @property
    def reason(self) -> str:
        """The reason as a word of docs/commands.md; empty without a status."""
        return "" if self.status is None else REASONS.get(self.status.reason_code, "unknown")

    @property
    def state(self) -> str:
        """The state as a word of docs/commands.md; empty without a status."""
        return "" if self.status is None else STATES.get(self.status.state, "unknown")

    @property
    def finding(self) -> str:
        """After INDETERMINATE: what a later read-back found."""
        return "" if self.status is None else FINDINGS.get(self.status.finding, "unknown")

    @property
    def token(self) -> bytes:
        """After PREPARED: for CommandRequest.token."""
        return bytes(16) if self.status is None else bytes(self.status.token)


def is_complete(status: command_status_t) -> bool:
    """Returns True if no further status of the command comes: an INDETERMINATE is followed by its finding."""
    return bool(status.is_final) and (status.state != command_status_t.STATE_INDETERMINATE
                                      or status.finding != command_status_t.FINDING_NONE)


def encode_body(command_id: bytes, request: CommandRequest, mode: int, bridge_boot_id: int = 0, bridge_mono_ns: int = 0,
                signed_by: int = 0) -> bytes:
    """Returns an encoded command_body_t. `mode`: command_body_t.MODE_*."""
    body = command_body_t()
    body.id = command_id
    body.bridge_boot_id = bridge_boot_id
    body.issued_mono_ns = bridge_mono_ns
    body.valid_ms = request.valid_ms
    body.device = request.device
    body.operation = request.operation
    body.mode = mode
    body.token = request.token or bytes(16)
    body.expect_epoch = request.expect_epoch
    for key, value in request.arguments.items():
        argument = argument_t()
        argument.key, argument.value = key, value
        body.arguments.append(argument)
    body.n_arguments = len(body.arguments)
    body.reason = request.reason
    body.key_id = signed_by
    return body.encode()


def signed_body(command_id: bytes, request: CommandRequest, mode: int, bridge_boot_id: int, bridge_mono_ns: int,
                keys: Keys) -> tuple[bytes, bytes]:
    """Returns an encoded command_body_t and its signature."""
    body = encode_body(command_id, request, mode, bridge_boot_id, bridge_mono_ns, key_id(keys.own))
    return body, sign(keys.own, COMMAND, body)


def query_body(command_id: bytes) -> tuple[bytes, bytes]:
    """Returns the request for the state of a command. It needs no signature and no boot of the bridge."""
    request = CommandRequest("", "", valid_ms=1_000)
    return encode_body(command_id, request, command_body_t.MODE_QUERY), bytes(64)
