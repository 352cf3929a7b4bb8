"""Commands and permits of the Python package: with a bridge, a driver and a simulated encoder that counts what it did; and a session alone."""

import asyncio
import json
import os
import re
import subprocess
import sys
import tempfile
import time
import unittest

from machine import Machine, one_axis, wait_for

sys.path.insert(0, os.environ["AXLECAST_PYTHON_PACKAGE"])
# pylint: disable=wrong-import-position
from axlecast import command_body_t, command_status_t  # noqa: E402
from axlecast.command import CommandRequest, Outcome  # noqa: E402
from axlecast.command_client import CommandClient  # noqa: E402
from axlecast.command_session import ASK_NS, NO_BRIDGE_NS, REPEAT_NS, SETTLED_NS, SILENCE_NS, CommandSession  # noqa: E402
from axlecast.permit_issuer import PermitIssuer  # noqa: E402
from axlecast.signing import Keys, digest, is_signed_by, load_key  # noqa: E402
from nacl.signing import SigningKey  # noqa: E402

LIMIT = 120  # s
ZERO = CommandRequest("axis1", "zero_single_turn", reason="shift change")


class Commands(Machine):
    """With one axis, whose bridge accepts only what is signed."""

    def run_machine(self, simulate="{start_deg: 100}", permit="not_required"):
        code, out, err = self.axlecast("keygen", "--machine", "test", "--directory", self.folder / "keys", "--json")
        self.assertEqual(code, 0, err)
        block = json.loads(out)["yaml"]
        for name, role in (("chief", "maintainer"), ("plc", "control")):
            code, out, err = self.axlecast("keygen", self.key(name), "--role", role, "--json")
            self.assertEqual(code, 0, err)
            block += f"    {name}: {{public: {json.loads(out)['keys'][0]['public']}, role: {role}}}\n"
        self.bridge_key = re.search(r"bridge:\s+.*?public: \"?([0-9a-f]{64})", block, re.DOTALL)[1]
        self.config = self.write(one_axis(simulate, bridge=block).replace("permit: not_required", f"permit: {permit}"))
        self.data = self.watch(self.config, "--commands")
        self.simulator(self.config, "rs485-0")
        self.driver(self.config, "rs485-0")
        self.serving = self.bridge(self.config)
        self.wait_online(self.data)

    def key(self, name):
        return self.folder / f"{name}.key"

    def client(self, **changes):
        client = CommandClient(**{"machine": "test", "key_file": self.key("chief"), "bridge_key": self.bridge_key, **changes})
        self.addCleanup(client.close)
        return client

    def zeroings(self):
        return self.simulated(self.config, "rs485-0")["devices"]["axis1"]["zeroings"]

    def test_a_signed_command_is_executed_once(self):
        self.run_machine()
        news = []
        result = self.client(on_status=news.append).execute(ZERO, LIMIT)
        self.assertIs(result.outcome, Outcome.DONE, result)
        self.assertEqual((result.problem, result.state, result.under_way), ("", "succeeded", False))
        self.assertEqual(self.zeroings(), 1)
        self.assertEqual([each.under_way for each in news], [True] * (len(news) - 1) + [False])
        code, out, err = self.axlecast("history", result.id.hex(), "--config", self.config, "--json")
        self.assertEqual(json.loads(out.splitlines()[0])["who"], "chief", out + err)
        # Another client reads the outcome without a key; an id that nobody has used is not known.
        reader = self.client(key_file=None)
        self.assertIs(reader.query(result.id).outcome, Outcome.DONE)
        unknown = reader.query(bytes(15) + b"\1")
        self.assertIs(unknown.outcome, Outcome.UNKNOWN)
        self.assertIn("does not know this id", unknown.problem)

    def test_what_is_refused_states_whether_it_is_temporary(self):
        self.run_machine("{speed_rpm: 30}")
        moving = self.client().execute(ZERO, LIMIT)
        self.assertEqual((moving.outcome, moving.reason, moving.temporary), (Outcome.REJECTED, "not_standing_still", True), moving)
        wrong = self.client().execute(CommandRequest("axis1", "dance"), LIMIT)
        self.assertEqual((wrong.outcome, wrong.reason, wrong.temporary), (Outcome.REJECTED, "unknown_operation", False), wrong)
        unsigned = self.client(key_file=None).execute(ZERO, LIMIT)
        self.assertEqual((unsigned.outcome, unsigned.reason), (Outcome.REJECTED, "unsigned"), unsigned)
        self.assertEqual(self.zeroings(), 0)

    def test_a_permit_lets_a_command_pass_until_it_is_withdrawn(self):
        self.run_machine(permit="required")
        client = self.client()
        self.assertEqual(client.execute(ZERO, LIMIT).reason, "no_permit")
        with PermitIssuer(machine="test", key_file=self.key("plc")) as issuer:
            command = client.send(ZERO)
            while not command.done:
                issuer.allow("axis1", ["zero_single_turn"], 500)
                client.wait(command, 0.05)
            self.assertIs(command.result.outcome, Outcome.DONE, command.result)
            issuer.withdraw("axis1")
            self.assertEqual(client.execute(ZERO, LIMIT).reason, "no_permit")
        self.assertEqual(self.zeroings(), 1)

    def test_a_foreign_bridge_is_not_believed(self):
        self.run_machine()
        other = bytes(SigningKey.generate().verify_key).hex()
        result = self.client(bridge_key=other).execute(ZERO, LIMIT)
        self.assertIs(result.outcome, Outcome.NOT_ACCEPTED)
        self.assertIn("does not fit the bridge key", result.problem)
        self.assertEqual(self.zeroings(), 0)

    def test_two_steps(self):
        self.run_machine()
        client = self.client()
        prepared = client.execute(CommandRequest("axis1", "zero_single_turn", prepare=True), LIMIT)
        self.assertIs(prepared.outcome, Outcome.PREPARED, prepared)
        self.assertEqual(self.zeroings(), 0)
        done = client.execute(CommandRequest("axis1", "zero_single_turn", token=prepared.token), LIMIT)
        self.assertIs(done.outcome, Outcome.DONE, done)
        self.assertEqual(self.zeroings(), 1)

    def test_tasks_wait_beside_one_another(self):
        self.run_machine()
        client = self.client()

        async def run():
            reads = [client.finish(client.send(CommandRequest("axis1", "read_all"))) for _ in range(5)]
            return await asyncio.wait_for(asyncio.gather(*reads, client.finish(client.send_query(bytes(15) + b"\1"))), LIMIT)

        *reads, query = asyncio.run(run())
        self.assertEqual([read.state for read in reads], ["succeeded"] * 5, reads)
        self.assertIn("does not know this id", query.problem)

    def test_a_command_survives_a_restart_of_the_bridge(self):
        self.run_machine()
        client = self.client()
        first = client.execute(ZERO, LIMIT)
        self.assertIs(first.outcome, Outcome.DONE, first)
        self.kill(self.serving)
        self.serving = self.bridge(self.config)
        # A query that began before the new bridge serves waits for it.
        wait_for(lambda: client.query(first.id).outcome is Outcome.DONE, "the outcome of the journal")
        # A zero of an axis at zero changes nothing that could be read back.
        self.assertIs(client.execute(ZERO, LIMIT).outcome, Outcome.DONE_UNVERIFIED)
        self.assertEqual(self.zeroings(), 2)

    def test_the_example_zeroes_with_its_own_permits(self):
        self.run_machine(permit="required")
        example = os.path.join(os.environ["AXLECAST_SOURCE"], "client/example/zero_with_permit.py")
        done = subprocess.run([sys.executable, "-B", example, "axis1", "--machine", "test", "--key", self.key("chief"),
                               "--permit-key", self.key("plc"), "--bridge-key", self.bridge_key],
                              capture_output=True, text=True, timeout=LIMIT, env={**os.environ, "PYTHONPATH": os.environ["AXLECAST_PYTHON_PACKAGE"]})
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stdout, "^done, and read back: .+\n$")
        self.assertEqual(self.zeroings(), 1)


class WithoutBridge(unittest.TestCase):
    def test_nothing_is_done(self):
        with CommandClient() as client:
            begin = time.monotonic()
            result = client.execute(ZERO, LIMIT)
            self.assertIs(result.outcome, Outcome.NOT_ACCEPTED)
            self.assertTrue(result.temporary)
            self.assertIn("start axlecast-bridge", result.problem)
            self.assertGreaterEqual(time.monotonic() - begin, 3)
            pending = client.wait(client.send(ZERO), 0)
            self.assertEqual((pending.outcome, pending.under_way), (Outcome.UNKNOWN, True))
            self.assertIn("no status came yet", pending.problem)

    def test_a_request_that_does_not_fit_is_not_sent(self):
        cases = {"valid_ms is 0": {"valid_ms": 0}, "16 arguments": {"arguments": {str(i): "" for i in range(17)}}, "NUL": {"reason": "a\0"},
                 "160 bytes": {"reason": "ü" * 81}, "1200 bytes": {"arguments": {"a": "x" * 1_300}},
                 "prepares and commits": {"prepare": True, "token": bytes(16)}, "16 bytes": {"token": b"1"}}
        with CommandClient() as client:
            for text, change in cases.items():
                result = client.execute(CommandRequest("axis1", "home", **change))
                self.assertEqual((result.outcome, result.temporary), (Outcome.NOT_ACCEPTED, False))
                self.assertIn(text, result.problem)


class KeyFiles(unittest.TestCase):
    def test_a_key_that_others_may_read_is_refused(self):
        folder = self.enterContext(tempfile.TemporaryDirectory())
        file = os.path.join(folder, "plc.key")
        key = SigningKey.generate()
        with open(file, "w", encoding="ascii") as out:
            out.write("axlecast-key-1 " + bytes(key).hex() + "\n")
        os.chmod(file, 0o600)
        self.assertEqual(load_key(file), key)
        os.chmod(file, 0o604)
        with self.assertRaisesRegex(ValueError, "open to other users: chmod 640"):
            load_key(file)
        os.chmod(file, 0o600)
        with open(file, "w", encoding="ascii") as out:
            out.write("axlecast-key-1 1234\n")
        with self.assertRaisesRegex(ValueError, "axlecast keygen FILE"):
            load_key(file)
        with self.assertRaises(FileNotFoundError):
            load_key(file + "0")
        with self.assertRaisesRegex(ValueError, "64 hex digits"):
            CommandClient(bridge_key="12")


class Session(unittest.TestCase):
    """One command, with statuses and instants given by the test."""

    ID = bytes(range(16))

    def setUp(self):
        self.session = CommandSession(self.ID, ZERO, Keys(), 0)
        self.seq = 0

    def status(self, now, boot=1, body=None, **values):
        status = command_status_t()
        status.token, status.sig = bytes(16), bytes(64)
        status.id, status.boot_id, status.mono_ns, status.seq = self.ID, boot, now + 10**9, self.seq
        status.body_digest = digest(body) if body else 0
        self.seq += 1
        for key, value in values.items():
            setattr(status, key, value)
        return self.session.on_status(status, status.encode(), now)

    def sent(self, now):
        message = self.session.next_message(now)
        return None if message is None else command_body_t.decode(message[0])

    def learned(self):
        """Returns the encoded command, which was sent at 0."""
        self.assertEqual(self.sent(0).mode, command_body_t.MODE_QUERY)
        self.status(0)
        return self.session.next_message(0)[0]

    def test_it_learns_the_bridge_and_repeats_the_same_bytes(self):
        body = self.learned()
        decoded = command_body_t.decode(body)
        self.assertEqual((decoded.bridge_boot_id, decoded.issued_mono_ns, decoded.operation), (1, 10**9, "zero_single_turn"))
        self.assertIsNone(self.session.next_message(REPEAT_NS - 1))
        self.assertEqual(self.session.next_message(REPEAT_NS)[0], body)
        self.assertTrue(self.status(REPEAT_NS, body=body, state=command_status_t.STATE_RUNNING))
        self.assertIsNone(self.session.next_message(2 * REPEAT_NS))
        self.assertEqual(self.sent(REPEAT_NS + ASK_NS).mode, command_body_t.MODE_QUERY)
        self.assertTrue(self.status(ASK_NS, body=body, state=command_status_t.STATE_SUCCEEDED, is_final=1, verified=1))
        self.assertTrue(self.session.done)
        self.assertIs(self.session.result.outcome, Outcome.DONE)

    def test_a_late_status_does_not_replace_a_newer_one(self):
        body = self.learned()
        self.status(1, body=body, seq=9, state=command_status_t.STATE_RUNNING, progress=0.5)
        self.assertFalse(self.status(2, body=body, seq=8, state=command_status_t.STATE_ACCEPTED))
        self.assertEqual(self.session.result.state, "running")

    def test_after_indeterminate_the_finding_follows(self):
        body = self.learned()
        self.status(1, body=body, state=command_status_t.STATE_INDETERMINATE, is_final=1)
        self.assertFalse(self.session.done)
        self.assertFalse(self.status(2, body=body, state=command_status_t.STATE_RUNNING))
        self.assertTrue(self.status(3, body=body, state=command_status_t.STATE_INDETERMINATE, is_final=1,
                                    finding=command_status_t.FINDING_EFFECT_SEEN))
        self.assertEqual((self.session.done, self.session.result.outcome, self.session.result.finding),
                         (True, Outcome.INDETERMINATE, "effect_seen"))

    def test_a_new_boot_that_has_the_journal_is_followed(self):
        body = self.learned()
        self.status(1, body=body, state=command_status_t.STATE_RUNNING)
        self.assertTrue(self.status(2, boot=2, body=body, seq=0, state=command_status_t.STATE_SUCCEEDED, is_final=1))
        self.assertIs(self.session.result.outcome, Outcome.DONE_UNVERIFIED)

    def test_a_new_boot_that_never_accepted_it_ends_it(self):
        self.learned()
        self.assertFalse(self.status(1, boot=2))
        self.assertEqual(self.sent(1).mode, command_body_t.MODE_QUERY)
        self.assertFalse(self.status(SETTLED_NS - 1, boot=2))
        self.assertFalse(self.session.done, "what was sent to the old boot may be on its way")
        self.status(SETTLED_NS, boot=2)
        self.assertIs(self.session.result.outcome, Outcome.NOT_ACCEPTED)
        self.assertTrue(self.session.result.can_resend)

    def test_a_new_boot_without_an_accepted_command_leaves_the_outcome_unknown(self):
        body = self.learned()
        self.status(1, body=body, state=command_status_t.STATE_RUNNING)
        self.status(2, boot=2)
        self.status(1 + SETTLED_NS, boot=2)
        self.assertIs(self.session.result.outcome, Outcome.UNKNOWN)
        self.assertIn("check the device", self.session.result.problem)

    def test_silence_ends_it(self):
        self.assertIsNotNone(self.session.next_message(NO_BRIDGE_NS))
        self.assertIsNone(self.session.next_message(NO_BRIDGE_NS + 1))
        self.assertIs(self.session.result.outcome, Outcome.NOT_ACCEPTED)
        self.session = CommandSession(self.ID, ZERO, Keys(), 0)
        self.learned()
        self.session.next_message(SILENCE_NS)
        self.assertFalse(self.session.done)
        self.session.next_message(SILENCE_NS + 1)
        self.assertIs(self.session.result.outcome, Outcome.UNKNOWN)

    def test_a_cancellation_is_repeated_until_the_outcome(self):
        body = self.learned()
        self.status(1, body=body, state=command_status_t.STATE_ACCEPTED)
        self.session.cancel(2)
        self.assertEqual(self.sent(2).mode, command_body_t.MODE_CANCEL)
        self.assertEqual(self.sent(2 + REPEAT_NS).mode, command_body_t.MODE_CANCEL)
        self.status(3, body=body, state=command_status_t.STATE_CANCELLED, is_final=1)
        self.assertIs(self.session.result.outcome, Outcome.CANCELLED)

    def test_what_was_not_sent_is_cancelled_at_once(self):
        self.session.cancel(0)
        self.assertEqual((self.session.done, self.session.result.outcome), (True, Outcome.CANCELLED))

    def test_a_signature_covers_each_byte_of_a_status(self):
        key = SigningKey.generate()
        status = command_status_t()
        status.id, status.token, status.sig, status.text = self.ID, bytes(16), bytes(64), "done"
        status.sig = key.sign(b"axlecast-status-1" + status.encode()).signature
        encoded = bytearray(status.encode())
        self.assertTrue(is_signed_by(key.verify_key, bytes(encoded)))
        for i in range(len(encoded)):
            encoded[i] ^= 1
            self.assertFalse(is_signed_by(key.verify_key, bytes(encoded)), f"byte {i}")
            encoded[i] ^= 1
        self.assertFalse(is_signed_by(key.verify_key, b"short"))


if __name__ == "__main__":
    unittest.main()
