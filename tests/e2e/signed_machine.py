"""A machine with keys: nothing unsigned is obeyed. The keys are made by `axlecast keygen`, as docs/keys.md describes."""

import json

from machine import BIN, Machine, wait_for


class SignedMachine(Machine):
    def make_keys(self):
        """The mapping `bridge` of the machine's file; self.keys has the key files, `plc` one that may permit."""
        self.keys = self.folder / "etc"
        code, out, err = self.axlecast("keygen", "--machine", "test", "--directory", self.keys, "--json")
        self.assertEqual(code, 0, err)
        text = json.loads(out)["yaml"]
        code, out, err = self.axlecast("keygen", self.keys / "plc.key", "--role", "control", "--json")
        self.assertEqual(code, 0, err)
        public = json.loads(out)["keys"][0]["public"]
        grant = f"    plc: {{public: {public}, role: control, operations: [zero_single_turn], file: {self.keys / 'plc.key'}}}\n"
        return text.rstrip("\n") + "\n" + grant

    def key_id(self, name):
        code, out, err = self.axlecast("keygen", "--show", self.keys / f"{name}.key", "--json")
        self.assertEqual(code, 0, err)
        return json.loads(out)["keys"][0]["key_id"]

    def run_signed_axis(self):
        """One axis that asks for permits."""
        self.config = self.write(f"""machine: test
{self.make_keys()}
buses:
  rs485-0:
    family: tformat
    poll_hz: 500
    simulate:
      axis1: {{start_deg: 100}}
    devices:
      axis1: {{model: ts5669n127, unit: deg, publish_hz: 100, permit: required, timeout_us: 500000, eeprom_writable: [10]}}
""")
        self.data = self.watch(self.config, "--commands")
        self.simulator(self.config, "rs485-0")
        self.driver(self.config, "rs485-0")
        self.bridge(self.config)
        self.wait_online(self.data)
        wait_for(lambda: "serving commands" in self.log("bridge"), lambda: self.log("bridge"))

    def command(self, *words):
        """Exit code and outcome, signed by the maintainer's key."""
        return self.outcome(*words, "--key", self.keys / "local.key")

    def permitted(self, *words):
        """While permits go out: given again when a busy machine let them end meanwhile."""
        def once():
            code, outcome = self.command(*words)
            return None if outcome.get("reason") == "no_permit" else (code, outcome)
        return wait_for(once, f"{words}: a permit in time")

    def start_permits(self, *operations, before=(), env=None):
        """`before`: a program that starts the process, for example in another time namespace."""
        permits = self.start("permit", *before, BIN / "axlecast", "permit", "axis1", *operations, "--for", "10min", "--key",
                             self.keys / "plc.key", "--config", self.config, env=env)
        wait_for(lambda: self.data.last("PERMIT/axis1"), lambda: "a permit: " + self.log("permit"))
        return permits

    def encoder(self):
        return self.simulated(self.config, "rs485-0")["devices"]["axis1"]
