"""The frames of an SAA encoder on CAN as the manual, 5.4.1 (3), prints them. Written from the document; nothing here comes from
axlecast's code."""

CONFIGURATION = 0x7E5
BIT_RATES = {0: 1_000_000, 2: 500_000, 3: 250_000}
# D0 of a command to 2NN, and its name in docs/decode.md.
COMMANDS = {0x01: "start_request", 0x80: "read_position_request", 0x20: "zero_request", 0x22: "set_direction_request",
            0x31: "set_period_request"}
# Items 4 to 8: a reply repeats D0, and D1 is 0.
REPLIES = {0x20: "zero", 0x22: "set_direction", 0x31: "set_period"}


def position(node, counts, size=2, big=False):
    """Item 1: the bottom eight bits, the top eight bits, zeros."""
    return 0x100 + node, counts.to_bytes(size, "big" if big else "little").ljust(8, b"\0")


def command(node, code, value=0):
    return 0x200 + node, bytes([code, node, value]).ljust(8, b"\0")


def bytes_of(bits):
    return (bits + 7) // 8


def read(number, data, bits, node, big=False):
    """The content of a good frame of `node`, in the words of docs/decode.md; None: it must be refused."""
    if number == 0x100 + node:
        size = bytes_of(bits)
        if len(data) < size:
            return None
        counts = int.from_bytes(data[:size], "big" if big else "little")
        if counts >> bits:
            return None
        if data[0] in REPLIES and not any(data[1:]):
            return {"kind": f"position_or_{REPLIES[data[0]]}_reply", "node": node}
        return {"kind": "position", "node": node, "counts": counts}
    if number == 0x200 + node:
        if len(data) < 2 or data[0] not in COMMANDS or data[1] != node:
            return None
        if data[0] != 0x31:
            return {"kind": COMMANDS[data[0]], "node": node}
        return {"kind": COMMANDS[data[0]], "node": node, "per_second": data[2]} if len(data) > 2 else None
    return None
