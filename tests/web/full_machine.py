"""A made-up machine of which every view has something to show, with the long texts that real ones have."""

from fake_server import FakeServer, alarms, now_us

MOTOR_COLUMNS = [{"name": name, "unit": unit} for name, unit in (
    ("voltage_v", "V"), ("current_a", "A"), ("power_w", "W"), ("temperature_c", "°C"),
    ("accel_x_mps2", "m/s²"), ("accel_y_mps2", "m/s²"), ("accel_z_mps2", "m/s²"))]
PORT = "/dev/serial/by-id/usb-FTDI_FT232R_USB_UART_A50285BI-if00-port0"
VIEWS = ("machine", "charts", "buses", "trips", "commands", "recorders", "device/axis1", "device/conveyor")


class FullMachine(FakeServer):
    def hello(self):
        hello = super().hello()
        hello["buses"].append({"bus": "modbus-0", "family": "tsubaki_sc", "port": PORT, "simulated": False, "devices": ["conveyor"]})
        hello["devices"].append({"device": "conveyor", "bus": "modbus-0", "family": "tsubaki_sc", "model": "sc", "kind": "motor",
                                 "unit": "", "per_turn": 0, "columns": MOTOR_COLUMNS})
        return hello

    def state(self):
        state = super().state()
        t = state["utime"]
        axis = state["devices"][0]
        motor = {**axis, "device": "conveyor", "model": "sc", "errors": {"timeout": 12, "checksum": 3}, "reading": {
            "utime": t, "age_us": 1, "stale": False, "valid": True, "flags": ["analog_valid"], "voltage_v": 200.0, "current_a": 1.5,
            "power_w": 300.0, "temperature_c": 40.0, "accel_mps2": [0.1, 0.0, 9.8], "trip_count": 2, "tripped": False,
            "status": ["overheat"], "trip_factors": [["power upper A"], [], []], "stop_coil": 0, "logged_in": 1, "mains_hz": 50}}
        motor["limits"] = {"utime": t - 7_000_000, "heard_utime": t - 7_000_000, "margins": [
            margin("power_upper_a", "W", 300.0, 10000.0), margin("power_upper_b", "W", 300.0, 290.0),
            margin("power_lower_a", "W", 300.0, 100.0, -1), margin("power_lower_b", "W", 300.0, 0.0),
            margin("overheat", "°C", 40.0, 90.0), margin("excessive_shock", "m/s²", 9.81, None)]}
        state["devices"].append(motor)
        axis.update(counts_per_turn=131072, turns_range=65536, direction="ccw", poll_us=1000, publish_us=10000, good=123456789,
                    nv_writes=2, reference_lost=False, last_good_utime=t, firmware="1.23", serial="TS5669N127-000123",
                    errors={"timeout": 3, "framing": 77, "communication_alarm": 5})
        state["buses"].append({**state["buses"][0], "bus": "modbus-0", "errors": {"timeout": 12}, "last_error_utime": t - 5_000_000,
                               "last_error": "no reply from unit 3 within 50 ms, of request 01 04 00 00 00 12 cb"})
        state["recorders"] = [self.recorder(t, "RECORDING", 12), {**self.recorder(t, "ENDED", 0), "recorder": "run"}]
        return state

    @staticmethod
    def recorder(t, state, lost):
        return {"recorder": "main", "state": state, "heard_utime": t, "file_bytes": 123456789, "total_bytes": 99123456789,
                "file": "/var/log/axlecast/2026-11-23/main-20261123T031500Z-000017.lcm", "messages": 123456789, "lost": lost,
                "kernel_dropped": 7, "free_bytes": 123456789012, "messages_hz": 2500.0, "bytes_hz": 432000.0, "last_error": "",
                "last_error_utime": None, "senders": [{"sender": "axlecast-tformat[12345] 192.0.2.200:41234", "lost": lost}]}

    def tell_the_past(self):
        """What a server remembers: a motor's trend, alarms, a trip, commands."""
        t = now_us()
        self.say({"type": "trend", "device": "conveyor", "column": "power_w", "values": [300 + i % 9 for i in range(110)],
                  "utimes": [t - 1_000_000 * (110 - i) for i in range(110)]})
        self.say(alarms("axis1", [alarm("battery_alarm", "warning", "Check or replace the battery; the alarm clears itself"),
                                  alarm("counter_overflow", "error", "Move the axis to its reference and reset the turns")], []))
        self.say({"type": "trip", "device": "conveyor", "utime": t, "log_index": 1, "trip_count": 2, "factors": ["power upper A"],
                  "not_before_utime": t - 10**7, "not_after_utime": t, "interval_us": 100000, "quantities": MOTOR_COLUMNS,
                  "samples": [[100.0 + i * (row + 1) for i in range(20)] for row in range(7)]})
        for number, (state, text) in enumerate((("succeeded", "read back: 0 counts"), ("failed", "no reply from the device within 50 ms"),
                                                ("rejected", "the file does not permit this operation: permit: not_required"))):
            self.say({"type": "command", "id": f"{number:032x}", "utime": t, "device": "axis1", "operation": "zero_single_turn",
                      "state": state, "is_final": True, "verified": True, "unsigned": True, "reason": "", "text": text,
                      "started_utime": t, "finished_utime": t + 1234567,
                      "changes": [{"key": "single_turn", "before": "131071", "after": "0"}]})


def margin(name, unit, measured, limit, sign=1):
    return {"name": name, "unit": unit, "measured": measured, "limit": limit, "margin": sign * (limit - measured) if limit else None}


def alarm(name, severity, action):
    return {"name": name, "code": 1, "source": "device", "severity": severity, "state": "live", "first_utime": now_us(),
            "last_utime": now_us(), "count": 3, "action": action}
