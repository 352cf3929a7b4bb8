"""axlecast fleet fetch: the raw messages of a log come back as they were recorded."""

import json
import unittest

from machine import BIN  # noqa: F401 (the programs under test)
from shipped_machine import MACHINE, SHIP, ShippedMachine, digest, events

INCOMPLETE = 3


class Fetch(ShippedMachine):
    def setUp(self):
        super().setUp()
        self.output = self.folder / "fetched.lcm"

    def fetch(self, *words, output=None):
        return self.fleet("fetch", "--machine", MACHINE, *words, output or self.output)

    def fetched(self, *words):
        code, _, err = self.fetch(*words)
        self.assertEqual(code, 0, err)
        return self.output

    def test_a_whole_log_has_its_events_numbers_and_seals_again(self):
        fetched = list(events(self.fetched()))
        recorded = list(events(self.recorded))
        self.assertEqual(digest(self.output), digest(self.recorded))
        self.assertEqual([(number, channel) for number, _, channel, _ in fetched], [(number, channel) for number, _, channel, _ in recorded])
        code, out, err = self.axlecast("log", "verify", self.output, "--json")
        self.assertEqual(code, 0, out + err)
        machine = next(data for _, _, channel, data in fetched if channel == "AXLECAST/machine.yaml")
        self.assertEqual(machine.decode(), self.config.read_text())
        head = json.loads(next(data for _, _, channel, data in fetched if channel == "AXLECAST/recorder"))
        self.assertEqual((head["name"], head["host"], head["file_number"]), ("all", "host1", 0))

    def test_the_head_has_the_file_of_this_log_whichever_other_was_seen_before_it(self):
        self.cluster.sql("INSERT INTO axlecast.machine_file (machine, sha256, text, first_seen) "
                         "SELECT machine, '\\x00', 'machine: press3 # another', first_seen - interval '1 s' FROM axlecast.machine_file")
        self.assertEqual(digest(self.fetched()), digest(self.recorded))
        machine = next(data for _, _, channel, data in events(self.output) if channel == "AXLECAST/machine.yaml")
        self.assertEqual(machine.decode(), self.config.read_text())

    def test_redecode_finds_no_difference(self):
        code, out, err = self.axlecast("redecode", self.fetched(), "--diff", "--json")
        self.assertEqual(code, 0, err)
        self.assertTrue(json.loads(out)["same"])

    def test_a_part_is_numbered_from_0(self):
        self.must("retention", "raw", "unlimited")
        self.fetched("--channel", "^POSITION/", "--from", "1", "--until", "2")
        fetched = list(events(self.output))
        self.assertEqual([number for number, _, _, _ in fetched], list(range(len(fetched))))
        begin = next(utime for _, utime, channel, _ in events(self.recorded) if not channel.startswith("AXLECAST/"))
        messages = [(utime, channel, data) for _, utime, channel, data in fetched if not channel.startswith("AXLECAST/")]
        self.assertGreater(len(messages), 500)
        selected = [(utime, channel, data) for _, utime, channel, data in events(self.recorded)
                    if channel.startswith("POSITION/") and messages[0][0] <= utime <= messages[-1][0]]
        self.assertEqual(messages, selected)
        self.assertLess(abs(messages[0][0] - begin - 1_000_000), 100_000)
        code, out, err = self.axlecast("log", "verify", self.output)
        self.assertEqual(code, 0, out + err)

    def test_a_folder_gets_each_log_under_its_name(self):
        code, _, err = self.fetch(output=f"{self.folder}/all/")
        self.assertEqual(code, 0, err)
        self.assertEqual([path.name for path in (self.folder / "all").iterdir()], [self.recorded.name])
        self.assertEqual(digest(self.folder / "all" / self.recorded.name), digest(self.recorded))

    def test_an_existing_file_stays(self):
        self.output.write_text("mine")
        self.assertEqual(self.fetch()[0], 4)
        self.assertEqual(self.output.read_text(), "mine")
        self.fetched("--force")
        self.assertEqual(digest(self.output), digest(self.recorded))

    def test_a_damaged_row_is_reported_and_the_rest_is_written(self):
        self.cluster.sql("""UPDATE axlecast.raw SET crc32c = (crc32c + 1) % 4294967296
            WHERE first_event = (SELECT first_event FROM axlecast.raw ORDER BY 1 OFFSET 1 LIMIT 1)""")
        code, _, err = self.fetch()
        self.assertEqual(code, INCOMPLETE, err)
        self.assertIn("CRC-32C", err)
        lost = int(self.cluster.value("SELECT n FROM axlecast.raw ORDER BY first_event OFFSET 1 LIMIT 1"))
        count = sum(not channel.startswith("AXLECAST/") for _, _, channel, _ in events(self.recorded))
        self.assertEqual(sum(not channel.startswith("AXLECAST/") for _, _, channel, _ in events(self.output)), count - lost)

    def test_a_missing_row_is_reported(self):
        self.cluster.sql("DELETE FROM axlecast.raw WHERE first_event = (SELECT first_event FROM axlecast.raw ORDER BY 1 OFFSET 1 LIMIT 1)")
        code, _, err = self.fetch()
        self.assertEqual(code, INCOMPLETE, err)
        self.assertIn("missing by their numbers", err)

    def test_a_hole_in_the_range_is_reported(self):
        self.cluster.sql("""INSERT INTO axlecast.hole (machine, cause, t0, t1)
            SELECT id, 'disk nearly full', to_timestamp(last_utime / 1e6), to_timestamp(last_utime / 1e6) FROM axlecast.machine""")
        code, _, err = self.fetch()
        self.assertEqual(code, INCOMPLETE, err)
        self.assertIn("disk nearly full", err)
        self.assertEqual(digest(self.output), digest(self.recorded))

    def test_wrong_words_are_refused(self):
        self.assertIn("did you mean 'all'", self.fetch("--log", "al")[2])
        self.assertEqual(self.fetch("--channel", "(")[0], 1)
        self.assertFalse(self.output.exists())


class FetchNothing(ShippedMachine):
    ship = SHIP.replace(", raw: true", "")

    def test_without_raw_records_there_is_no_log(self):
        output = self.folder / "fetched.lcm"
        err = self.fails(INCOMPLETE, "fetch", "--machine", MACHINE, output)
        self.assertIn("raw: true", err)
        self.assertFalse(output.exists())


class FetchSomeChannels(ShippedMachine):
    ship = SHIP.replace("    - {channels: '.', detail: full, raw: true}", "    - {channels: '^WIRE/', detail: none, raw: true}")

    def test_only_these_channels_come_back(self):
        output = self.folder / "fetched.lcm"
        self.fleet("retention", "raw", "unlimited")
        code, _, err = self.fleet("fetch", "--machine", MACHINE, output)
        self.assertEqual(code, 0, err)
        self.assertEqual(digest(output), digest(self.recorded, lambda channel: channel.startswith("WIRE/")))


if __name__ == "__main__":
    unittest.main()
