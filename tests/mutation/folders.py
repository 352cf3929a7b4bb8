"""The folders whose tests are tested: their sources, and the programs of their tests."""

FOLDERS = {
    # What test_mutation.py tests the tool with.
    "sample": (["tests/mutation/sample/limited.cpp"], ["mutation_sample_test"]),
    "sample_blind": (["tests/mutation/sample/limited.cpp"], ["mutation_sample_blind_test"]),
    "tformat": (["drivers/tformat/codec.cpp"], ["family_tformat_test"]),
    "saa_serial": (["drivers/saa_serial/codec.cpp", "drivers/saa_serial/stream_parser.cpp"], ["family_saa_serial_test"]),
    "saa_modbus": (["drivers/saa_modbus/codec.cpp"], ["family_saa_modbus_test"]),
    "saa_can": (["drivers/saa_can/codec.cpp"], ["family_saa_can_test"]),
    "ssi": (["drivers/ssi/codec.cpp"], ["family_ssi_test"]),
    "biss": (["drivers/biss/codec.cpp"], ["family_biss_test"]),
    "tsubaki_sc": (["drivers/tsubaki_sc/requests.cpp", "drivers/tsubaki_sc/register_map.cpp"], ["family_tsubaki_sc_test"]),
    "modbus": (["drivers/protocol/modbus/adu.cpp"], ["protocol_modbus_test"]),
    "canopen": (["drivers/protocol/canopen/canopen.cpp"], ["protocol_canopen_test"]),
    "axis": ([f"drivers/runtime/axis/{name}.cpp" for name in ("axis", "motion", "device_publisher", "device_health")],
             ["runtime_axis_test"]),
    "dispatch": ([f"bridge/dispatch/{name}.cpp" for name in ("command_port", "device_queue", "dispatcher", "outcome_check")],
                 ["bridge_dispatch_test"]),
    "command_runner": (["drivers/kit/command_runner.cpp"], ["kit_test"]),
    "execution": ([f"drivers/runtime/command/{name}.cpp" for name in (
        "axis_commands", "command_authority", "driver_command_server", "operations")], ["runtime_command_test"]),
    "journal": ([f"bridge/store/{name}.cpp" for name in ("database", "history", "journal_queue", "rows", "sqlite_devices",
                                                         "sqlite_journal", "sqlite_store")], ["bridge_store_test"]),
    "state": ([f"bridge/state/{name}.cpp" for name in ("command_store", "device_state")],
              ["bridge_state_test", "bridge_dispatch_test"]),
    "recorder": ([f"tools/recorder/{name}.cpp" for name in ("log_composer", "log_writer", "message_receiver", "recording_health",
                                                            "recording_session")], ["recorder_test"]),
    "log_file": (["platform/os/log_file.cpp"], ["platform_os_test"]),
    "receiver": (["platform/net/udpm_receiver.cpp", "platform/net/lcm_receiver.cpp"],
                 ["platform_net_test", "platform_multicast_test"]),
}
