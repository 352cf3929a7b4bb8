"""libmodbus's client by ctypes."""

import ctypes
import errno
import os
import select
import time

ERROR_BASE = 112345678  # modbus.h: MODBUS_ENOBASE; an exception's code comes on top


class Refused(Exception):
    """The unit's error code."""

    @property
    def code(self):
        return self.args[0]


class NoAnswer(Exception):
    pass


class Client:
    def __init__(self, port, baud, timeout=1.0):
        self._library = ctypes.CDLL("libmodbus.so.5", use_errno=True)
        self._library.modbus_new_rtu.restype = ctypes.c_void_p
        context = self._library.modbus_new_rtu(os.fsencode(port), baud, ctypes.c_char(b"N"), 8, 1)
        self._context = ctypes.c_void_p(context)
        self._call("modbus_connect")
        self._call("modbus_set_response_timeout", ctypes.c_uint32(int(timeout)), ctypes.c_uint32(int(timeout % 1 * 1e6)))

    def close(self):
        if self._context is None:
            return
        self._library.modbus_close(self._context)
        self._library.modbus_free(self._context)
        self._context = None

    def _call(self, name, *arguments):
        result = getattr(self._library, name)(self._context, *arguments)
        if result >= 0:
            return result
        error = ctypes.get_errno()
        if error > ERROR_BASE:
            raise Refused(error - ERROR_BASE)
        if error == errno.ETIMEDOUT:
            raise NoAnswer
        raise OSError(error, name)

    def address(self, slave):
        self._call("modbus_set_slave", slave)

    def _read(self, name, cell, first, count):
        cells = (cell * count)()
        self._call("modbus_flush")
        self._call(name, first, count, cells)
        return list(cells)

    def coils(self, first, count=1):
        return self._read("modbus_read_bits", ctypes.c_uint8, first, count)

    def inputs(self, first, count=1):
        return self._read("modbus_read_input_bits", ctypes.c_uint8, first, count)

    def holding(self, first, count=1):
        return self._read("modbus_read_registers", ctypes.c_uint16, first, count)

    def input_registers(self, first, count=1):
        return self._read("modbus_read_input_registers", ctypes.c_uint16, first, count)

    def write_coil(self, address, value):
        self._call("modbus_write_bit", address, value)

    def write_register(self, address, value):
        self._call("modbus_write_register", address, ctypes.c_uint16(value))

    def write_registers(self, first, values):
        self._call("modbus_write_registers", first, len(values), (ctypes.c_uint16 * len(values))(*values))

    def raw(self, request, size, limit=5.0):
        """libmodbus adds the CRC and sends; the reply's `size` bytes are read here, for libmodbus has its own opinion
        of their number."""
        self._call("modbus_flush")
        self._call("modbus_send_raw_request", (ctypes.c_uint8 * len(request))(*request), len(request))
        socket = self._library.modbus_get_socket(self._context)
        data = b""
        deadline = time.monotonic() + limit
        while len(data) < size:
            if not select.select([socket], [], [], max(0.0, deadline - time.monotonic()))[0]:
                raise NoAnswer(data.hex(" "))
            data += os.read(socket, size - len(data))
        return data


def crc(data):
    """SC guideline 4, SAA manual 5.1.7: preset FFFF, polynomial A001."""
    value = 0xFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ (0xA001 if value & 1 else 0)
    return value


def with_crc(data, msb_first=False):
    return bytes(data) + crc(data).to_bytes(2, "big" if msb_first else "little")
