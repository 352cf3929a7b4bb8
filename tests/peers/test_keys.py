"""Keys of `axlecast keygen` beside OpenSSL's Ed25519: the same secret has the same public half there, and the key id is
the hash that lcmtypes/command_body_t.lcm and signature.h name."""

import hashlib
import json
import stat
import subprocess
import unittest

from machine import Machine

# RFC 8410, 7: a PrivateKeyInfo of Ed25519 up to the 32 bytes of the seed; and 4: the last 32 bytes of a public key's.
PRIVATE = bytes.fromhex("302e020100300506032b657004220420")
KEY_BYTES = 32


class Keys(Machine):
    def make(self, *arguments):
        code, out, err = self.axlecast("keygen", *map(str, arguments), "--json")
        self.assertEqual((code, err), (0, ""))
        return json.loads(out)["keys"]

    def openssl(self, *arguments, data):
        done = subprocess.run(["openssl", *arguments], input=data, capture_output=True, timeout=30)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def test_openssl_finds_the_same_public_half(self):
        seen = set()
        for number in range(8):
            file = self.folder / f"{number}.key"
            (key,) = self.make(file)
            head, seed = file.read_text(encoding="ascii").split()
            self.assertEqual(head, "axlecast-key-1")
            public = self.openssl("pkey", "-inform", "DER", "-pubout", "-outform", "DER",
                                  data=PRIVATE + bytes.fromhex(seed))[-KEY_BYTES:]
            self.assertEqual(key["public"], public.hex())
            self.assertEqual(key["key_id"], hashlib.blake2b(public, digest_size=32).hexdigest()[:16])
            seen |= {seed, key["public"]}
        self.assertEqual(len(seen), 16)

    def test_a_machines_keys_are_the_owners_only(self):
        for key in self.make("--machine", "press3", "--directory", self.folder / "keys"):
            mode = stat.S_IMODE((self.folder / "keys" / f"{key['name']}.key").stat().st_mode)
            self.assertEqual(mode, 0o600)
        code, out, err = self.axlecast("keygen", "--machine", "press3", "--directory", str(self.folder / "keys"))
        self.assertEqual((code, out), (1, ""))
        self.assertIn("bridge.key exists already", err)
        self.assertNotIn("axlecast-key-1", err)


if __name__ == "__main__":
    unittest.main()
