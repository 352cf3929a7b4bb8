"""What a T-format frame means, read by itself: from the maker's specification of the TS5669 N127, and nothing else. The tables are those
of tests/peers/tformat.py."""

import tformat

SIZES = {"0": 6, "1": 6, "2": 4, "3": 11, "7": 6, "8": 6, "C": 6}  # CF, SF, data fields of table 2, CRC
NAMES = {"0": "read_single_turn", "1": "read_multi_turn", "2": "read_encoder_id", "3": "read_all", "7": "clear_errors",
         "8": "zero_single_turn", "C": "reset_turns_and_errors"}
ALARMS = {tformat.OS: "over_speed", tformat.FS: "full_absolute_status", tformat.CE: "counting_error", tformat.OF: "counter_overflow",
          tformat.ME: "multi_turn_error", tformat.BE: "battery_error", tformat.BA: "battery_alarm"}
FIXED_ALMC = 0x10  # table 3: d74 is "0"
INFORMATION = 0x0F  # 6.3.2 (2): all fixed to "0"
BY_CONTROL = {tformat.control(name): name for name in tformat.CODES}


def eeprom(name, frame):
    """6.2.2, 6.2.3, 6.3.5: CF ADF EDF CRC; a request to read has no EDF."""
    sizes = (3, 4) if name == "D" else (4,)
    if len(frame) not in sizes or tformat.crc(frame):
        return None
    busy, address = frame[1] >> 7, frame[1] & 0x7F
    if address >= tformat.CELLS:
        return None
    if len(frame) == 3:
        return None if busy else {"kind": "eeprom_read_request", "address": address}
    if busy:  # table 4: EDF is 00 then, and no data
        return None if frame[2] else {"kind": "eeprom_write_reply" if name == "6" else "eeprom_read_reply", "address": address, "busy": True}
    found = {"kind": "eeprom_read_reply", "address": address, "busy": False, "data": f"0x{frame[2]:02x}"}
    if name == "6":  # a request and the reply that accepts it are the same bytes
        found["kind"] = "eeprom_write_request_or_reply"
        del found["busy"]
    return found


def alarms(status, almc):
    found = {name for bit, name in ALARMS.items() if almc & bit}
    if status & tformat.COUNTING_ERROR:
        found.add("counting_error")
    if status & tformat.TURNS_OR_BATTERY and not almc & (tformat.ME | tformat.BE | tformat.BA):
        found.add("multi_turn_or_battery")
    return found


def read(frame, bits=17, turn_bits=16, enid=None):
    """The content of a good frame, in the words of docs/decode.md; None: it must be refused."""
    name = BY_CONTROL.get(frame[0]) if frame else None
    if name in ("6", "D"):
        return eeprom(name, frame)
    if name is None:
        return None
    if len(frame) == 1:
        return {"kind": NAMES[name] + "_request"}
    if len(frame) != SIZES[name] or tformat.crc(frame):
        return None
    status, fields = frame[1], frame[2:-1]
    if status & (INFORMATION | tformat.PARITY_ALARM | tformat.DELIMITER_ALARM):
        return None
    found = {"kind": NAMES[name] + "_reply", "status": f"0x{status:02x}"}
    almc = 0
    for part in tformat.DATA[name]:
        size = 3 if part in ("ABS", "ABM") else 1
        value, fields = int.from_bytes(fields[:size], "little"), fields[size:]
        if part == "ABS":
            found["counts"] = value
        elif part == "ABM":
            found["turns"] = value
        elif part == "ENID":
            found["encoder_id"] = f"0x{value:02x}"
            if enid not in (None, value):
                return None
        else:
            almc = value
    if found.get("counts", 0) >> bits or found.get("turns", 0) >> turn_bits or almc & FIXED_ALMC:
        return None
    if turn_bits == 0:
        found.pop("turns", None)
    found["alarms"] = alarms(status, almc)
    return found
