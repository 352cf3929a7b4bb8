#!/usr/bin/python3
"""Zeroes an axis with permits of its own: zero_with_permit.py DEVICE --machine NAME --key FILE --permit-key FILE --bridge-key HEX

`--key` has the role maintainer, because a zero is destructive, and `--permit-key` the role control. The axis must be at rest and not controlled by anybody: only the control process of the machine knows that."""

import argparse
import sys

from axlecast.command import CommandRequest, Outcome
from axlecast.command_client import CommandClient
from axlecast.permit_issuer import PermitIssuer

parser = argparse.ArgumentParser()
parser.add_argument("device")
parser.add_argument("--machine", required=True)
parser.add_argument("--key", required=True)
parser.add_argument("--permit-key", required=True)
parser.add_argument("--bridge-key", required=True)
arguments = parser.parse_args()

with (CommandClient(machine=arguments.machine, key_file=arguments.key, bridge_key=arguments.bridge_key) as client,
      PermitIssuer(machine=arguments.machine, key_file=arguments.permit_key) as issuer):
    command = client.send(CommandRequest(arguments.device, "zero_single_turn", reason="example"))
    while not command.done:
        issuer.allow(arguments.device, ["zero_single_turn"], 500)
        client.wait(command, timeout=0.05)
    issuer.withdraw(arguments.device)
result = command.result
text = result.problem or (result.status.text if result.status else "")
print(f"{result.outcome.value}: {text}")
sys.exit(0 if result.outcome in (Outcome.DONE, Outcome.DONE_UNVERIFIED) else 1)
