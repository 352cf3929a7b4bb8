"""Tsubaki's SC unit as "SC unit communication guidelines" (the maker's document) describe it, served by pymodbus. The
register image is written from the document's lists 7 to 12; nothing here comes from axlecast's code."""

import asyncio
import logging
import struct
import threading

from pymodbus.datastore import ModbusServerContext
from pymodbus.framer.rtu_framer import ModbusRtuFramer
from pymodbus.interfaces import IModbusSlaveContext
from pymodbus.pdu import ModbusRequest, ModbusResponse
from pymodbus.server.async_io import ModbusSerialServer

logging.getLogger("pymodbus").setLevel(logging.CRITICAL)  # it logs each login error, and its own end
COIL, INPUT, HOLDING, REGISTER = 1, 2, 3, 4  # function codes that read them: guideline 6
TABLE_OF = {1: COIL, 2: INPUT, 3: HOLDING, 4: REGISTER, 5: COIL, 6: HOLDING, 15: COIL, 16: HOLDING}

# Guideline 7, "Data Address List": (table, first, last, whole): whole blocks take no single address (its note 1).
BLOCKS = [
    (COIL, 0, 0, False), (COIL, 100, 100, False), (COIL, 200, 200, False),
    (INPUT, 0, 0, False),
    (REGISTER, 0, 8, False), (REGISTER, 100, 106, False), (REGISTER, 200, 204, False), (REGISTER, 300, 300, False),
    *((REGISTER, 1000 * log + 100 * quantity, 1000 * log + 100 * quantity + 19, False)
      for log in (1, 2, 3) for quantity in range(7)),
    (HOLDING, 0, 54, False), (HOLDING, 100, 107, True), (HOLDING, 200, 207, True), (HOLDING, 300, 301, True),
    (HOLDING, 350, 354, True),
]
QUANTITIES = ("voltage", "current", "power", "temperature", "accel_x", "accel_y", "accel_z")
SIGNED = ("temperature", "accel_x", "accel_y", "accel_z")  # guideline 10: "otherwise, it is unsigned"
UNIT = {"voltage": 0.1, "current": 0.001, "power": 0.1, "temperature": 0.1,  # V, A (registers in mA), W, degrees C
        "accel_x": 0.01, "accel_y": 0.01, "accel_z": 0.01}  # m/s^2
LOGGED_OUT, LOGGED_IN = 0x0000, 0xFF00


def word(value):
    """A signed or unsigned number as a register holds it."""
    return value & 0xFFFF


def physical(quantity, register):
    """What a register means in SI units: guideline 10."""
    if quantity in SIGNED and register >= 0x8000:
        register -= 0x10000
    return register * UNIT[quantity]


def characters(text, registers):
    """ASCII in registers, two each, padded with NUL: guideline 11."""
    data = text.encode("ascii").ljust(2 * registers, b"\0")
    return list(struct.unpack(f">{registers}H", data))


class LoginError(Exception):
    """pymodbus answers an exception of the data store with error 04, the unit's login error (guideline 5)."""


class ReportSlaveIdResponse(ModbusResponse):
    """Guideline 12: version upper and lower, and no byte count."""

    function_code = 0x11

    def __init__(self, version):
        super().__init__()
        self.version = version

    def encode(self):
        return bytes(self.version)


class ReportSlaveIdRequest(ModbusRequest):
    function_code = 0x11
    _rtu_frame_size = 4

    def encode(self):
        return b""

    def decode(self, data):
        pass

    def execute(self, context):
        return ReportSlaveIdResponse(context.version)


class ScUnit(IModbusSlaveContext):
    """One unit's data. Registers hold what the unit would send; set them in the document's units."""

    def __init__(self, mfg_number, product_code="SC01", version=(1, 0), password="password", mains_60hz=False):
        self.version = version
        self.password = password.encode("ascii")
        self.coil_written = False
        self.writes = []  # (function, address, values), with the login left out
        self.tables = {table: {} for table in (COIL, INPUT, HOLDING, REGISTER)}
        for table, first, last, _ in BLOCKS:
            self.tables[table].update(dict.fromkeys(range(first, last + 1), 0))
        self.tables[INPUT][0] = int(mains_60hz)
        self.put(HOLDING, 300, characters(product_code, 2))
        self.put(HOLDING, 350, characters(mfg_number, 5))
        self.put(HOLDING, 54, [1])

    def put(self, table, first, values):
        for offset, value in enumerate(values):
            self.tables[table][first + offset] = word(value)

    def registers(self, table, first, count):
        return [self.tables[table][first + offset] for offset in range(count)]

    def set_live(self, **registers):
        for name, value in registers.items():
            self.put(REGISTER, 100 + QUANTITIES.index(name), [value])

    def trip(self, factor, samples):
        """A trip: its log becomes number 1, the others move up. `samples` are seven rows of twenty registers."""
        table = self.tables[REGISTER]
        table[200] += 1
        table[201] = factor
        table[204], table[203], table[202] = table[203], table[202], factor
        for log in (3, 2):
            for quantity in range(7):
                self.put(REGISTER, 1000 * log + 100 * quantity,
                         self.registers(REGISTER, 1000 * (log - 1) + 100 * quantity, 20))
        for quantity, row in enumerate(samples):
            self.put(REGISTER, 1000 + 100 * quantity, row)

    # -- pymodbus's data store

    def validate(self, function, address, count=1):
        table = TABLE_OF[function]
        for name, first, last, whole in BLOCKS:
            if name == table and first <= address <= last:
                return (address, address + count - 1) == (first, last) if whole else address + count - 1 <= last
        return False

    def getValues(self, function, address, count=1):  # noqa: N802 (pymodbus's name)
        if function == 5:
            return [self.coil_written]  # pymodbus asks for the echo; by then some coils have gone off
        if function == HOLDING and address == 100:
            return [0] * count  # "[NULL (0x00)] of 16 characters is read"
        if function == HOLDING and address == 200:
            if not self.logged_in:
                raise LoginError
            return characters(self.password.decode(), 8)
        return self.registers(TABLE_OF[function], address, count)

    @property
    def logged_in(self):
        return self.tables[REGISTER][300] == LOGGED_IN

    def setValues(self, function, address, values):  # noqa: N802 (pymodbus's name)
        table = TABLE_OF[function]
        if table == HOLDING and address == 100:
            return self.take_login(values)
        if not self.logged_in:
            raise LoginError
        self.writes.append((function, address, [int(value) for value in values]))
        if table == HOLDING and address == 200:
            self.password = struct.pack(">8H", *values).rstrip(b"\0 ")
        elif table == COIL:
            self.coil_written = values[0]
            self.take_coil(address, values[0])
        else:
            self.put(table, address, values)
        return None

    def take_login(self, values):
        if struct.pack(">8H", *values).rstrip(b"\0 ") != self.password:
            raise LoginError
        self.tables[REGISTER][300] = LOGGED_OUT if self.logged_in else LOGGED_IN

    def take_coil(self, address, value):
        """Guideline 8: "trip count clear" and "start" go off by themselves; start turns stop off."""
        if address == 100:
            self.tables[COIL][100] = int(value)
        elif address == 0 and value:
            self.tables[REGISTER][200] = 0
        elif address == 200 and value and self.tables[REGISTER][201] == 0:
            self.tables[COIL][100] = 0


class ModbusServer:
    """pymodbus's serial server for `units` (address: data store), in a thread of its own."""

    def __init__(self, port, units, requests=()):
        self._loop = asyncio.new_event_loop()
        self._port, self._units, self._requests = port, units, requests
        self._ready = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()
        self._ready.wait(10)

    def _run(self):
        asyncio.set_event_loop(self._loop)
        self._loop.run_until_complete(self._serve())
        self._loop.run_forever()
        # Its handler loops for ever when it outlives its event loop.
        handler = self._server.protocol.handler_task
        handler.cancel()
        self._loop.run_until_complete(asyncio.gather(handler, return_exceptions=True))
        self._loop.run_until_complete(self._server.shutdown())
        self._loop.close()

    async def _serve(self):
        context = ModbusServerContext(slaves=self._units, single=False)
        self._server = ModbusSerialServer(context, ModbusRtuFramer, port=self._port, baudrate=9600,
                                          ignore_missing_slaves=True)
        for request in self._requests:
            self._server.decoder.register(request)
        await self._server.start()
        self._ready.set()

    def do(self, change):
        """Calls `change` between two requests."""
        done = threading.Event()
        self._loop.call_soon_threadsafe(lambda: (change(), done.set()))
        done.wait(10)

    def close(self):
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(10)


def serve(port, units):
    return ModbusServer(port, units, [ReportSlaveIdRequest])
