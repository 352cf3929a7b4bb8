"""clock_id: equal on one host, and never equal by ignorance."""

import unittest

from machine import BIN, Machine, boot_id, clock_id, one_axis, unsigned, wait_for

# What a systemd unit with ProcSubset=pid sees.
WITHOUT_PROC_SYS = ["unshare", "--mount", "sh", "-c", 'mount -t proc -o subset=pid proc /proc && exec "$@"', "sh"]


class ClockId(Machine):
    def published(self, env, *before):
        config = self.write(one_axis())
        self.simulator(config, "rs485-0")
        self.start("driver", *before, BIN / "axlecast-tformat", "--config", config, "--bus", "rs485-0", env=env)
        watch = self.watch(config)
        wait_for(lambda: watch.last("POSITION/axis1"), lambda: self.log("driver"))
        return unsigned(watch.last("POSITION/axis1")["clock_id"])

    def test_is_the_hash_of_the_hosts_boot(self):
        self.assertEqual(self.published({}), clock_id())

    def test_is_known_to_a_unit_that_sees_no_proc_sys(self):
        self.assertEqual(self.published({"AXLECAST_BOOT_ID": boot_id()}, *WITHOUT_PROC_SYS), clock_id())

    def test_is_not_stated_if_the_boot_is_not_known(self):
        self.assertEqual(self.published({}, *WITHOUT_PROC_SYS), 0)


if __name__ == "__main__":
    unittest.main()
