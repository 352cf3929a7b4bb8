"""A writer that follows the rule of the ledger (docs/fleet.md), made of psql: rows and ledger commit together, an answer that does not come in
time or comes with a warning is no acknowledgement, and after each new connection the ledger is read before anything is sent."""
import selectors
import subprocess
import time

ANSWER_LIMIT_S = 10
TODAY = "date_trunc('day', now(), 'UTC')"

SETUP = """
SELECT axlecast.ensure_partitions(current_date - 1, current_date + 1);
INSERT INTO axlecast.machine (name, installation) VALUES ('press3', gen_random_uuid());
INSERT INTO axlecast.log (machine, name, host, start_utime, file_number) SELECT id, 'press3', 'host', 0, 0 FROM axlecast.machine;
"""

# 1 / count(*) fails unless the ledger was where this writer has read it.
BATCH = """BEGIN;
WITH ledger AS (UPDATE axlecast.log SET upto = {upto} + 1 WHERE name = 'press3' AND upto = {upto} RETURNING upto)
SELECT 1 / count(*) FROM ledger;
INSERT INTO axlecast.position_chunk (t0, t1, seq0, first, last, stream, log, n, valid, missed, flags_or, flags_and, body)
  SELECT {today} + {upto} * interval '100 ms', {today} + {upto} * interval '100 ms', {upto}, 0, 0, stream, 1, 250, 250, 0, 1, 1, ''
    FROM generate_series(1, 10) stream;
COMMIT;
\\echo acknowledged
"""


class NoAnswer(Exception):
    """The connection is closed, or must be."""


class LedgerWriter:
    def __init__(self, connection):
        self.connection = f"{connection} target_session_attrs=read-write connect_timeout=2"
        self.psql = None
        self.batches = 0         # acknowledged ones; a batch that was sent again counts twice
        self.behind = 0          # number behind the last acknowledged batch
        self.restarts = []       # (behind, ledger) at each new connection but the first
        self.longest_gap_s = 0.0
        self.last_answer = time.monotonic()

    def run(self, stop):
        """Sends batches until `stop` returns true."""
        upto = None
        while not stop():
            try:
                if upto is None:
                    upto = self._read_ledger()
                    if self.batches > 0:
                        self.restarts.append((self.behind, upto))
                self._ask(BATCH.format(upto=upto, today=TODAY), "acknowledged")
                upto += 1
                self.batches += 1
                self.behind = upto
                self._note_answer()
            except NoAnswer:
                self.close()
                upto = None

    def close(self):
        if self.psql:
            self.psql.kill()
            self.psql.communicate()
        self.psql = None

    def _note_answer(self):
        now = time.monotonic()
        self.longest_gap_s = max(self.longest_gap_s, now - self.last_answer)
        self.last_answer = now

    def _read_ledger(self):
        # pylint: disable=consider-using-with
        self.psql = subprocess.Popen(["psql", "-XqAt", "-v", "ON_ERROR_STOP=1", "-d", self.connection], bufsize=0,
                                     stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        lines = self._ask("SELECT upto FROM axlecast.log WHERE name = 'press3';\n\\echo ledger\n", "ledger")
        return int(lines[-1])

    def _ask(self, text, end):
        """Returns the lines that psql prints before the line `end`."""
        try:
            self.psql.stdin.write(text.encode())
        except BrokenPipeError as error:
            raise NoAnswer from error
        deadline = time.monotonic() + ANSWER_LIMIT_S
        received = b""
        with selectors.DefaultSelector() as selector:
            selector.register(self.psql.stdout, selectors.EVENT_READ)
            while not received.endswith(f"{end}\n".encode()):
                if not selector.select(max(0.0, deadline - time.monotonic())):
                    raise NoAnswer
                part = self.psql.stdout.read(65536)
                if not part:
                    raise NoAnswer
                received += part
        if b"WARNING" in received:
            raise NoAnswer
        return received.decode().splitlines()[:-1]
