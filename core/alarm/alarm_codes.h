#pragma once

#include <axlecast/alarm_entry_t.hpp>

#include "core/device/device.h"

namespace axlecast {

// The catalogue of every alarm that is not a device's own: docs/alarms.md. Codes and names never change.
namespace alarm_codes {

inline constexpr std::uint8_t kInfo = alarm_entry_t::SEVERITY_INFO;
inline constexpr std::uint8_t kWarning = alarm_entry_t::SEVERITY_WARNING;
inline constexpr std::uint8_t kError = alarm_entry_t::SEVERITY_ERROR;
inline constexpr std::uint8_t kCritical = alarm_entry_t::SEVERITY_CRITICAL;

inline constexpr std::uint8_t kDriver = alarm_entry_t::SOURCE_DRIVER;
inline constexpr std::uint8_t kBus = alarm_entry_t::SOURCE_BUS;
inline constexpr std::uint8_t kBridge = alarm_entry_t::SOURCE_BRIDGE;
inline constexpr std::uint8_t kRecorder = alarm_entry_t::SOURCE_RECORDER;
inline constexpr std::uint8_t kMqtt = alarm_entry_t::SOURCE_MQTT;
inline constexpr std::uint8_t kShip = alarm_entry_t::SOURCE_SHIP;

}  // namespace alarm_codes

// Of a driver, on any device of any family.
namespace runtime_alarms {
using namespace alarm_codes;

inline constexpr AlarmSpec kDeviceOffline = {
    100, kDriver, kError, "device_offline",
    "See DEVICE: reason. Check the encoder's supply, cable and configuration."};
inline constexpr AlarmSpec kReferenceLost = {101, kDriver, kError, "reference_lost",
                                             "Move to a known place and set the datum, or reset the turns."};
inline constexpr AlarmSpec kImplausibleBurst = {
    102, kDriver, kWarning, "implausible_burst",
    "Check cable, shield and termination; check limits in the configuration."};
inline constexpr AlarmSpec kClockStepped = {103, kDriver, kInfo, "clock_stepped",
                                            "UNIX time jumped. Check NTP or PTP; compare mono_ns across the step."};
inline constexpr AlarmSpec kPositionJumped = {
    104, kDriver, kWarning, "position_jumped",
    "It moved further than the shaft can. Check encoder and coupling; set the datum."};
inline constexpr AlarmSpec kTurnsPassedEnd = {
    105, kDriver, kError, "turns_passed_end",
    "The axis is beyond the range that `turns` allows. Move back, or reset the turns."};
inline constexpr AlarmSpec kUnauthorizedCommand = {
    106, kDriver, kWarning, "foreign_order",
    "Commands without the bridge's signature: see the log; find who sends them."};
inline constexpr AlarmSpec kLinkDown = {
    200, kBus, kError, "link_down",
    "See DEVICE: reason. Plug the adapter in, or correct the port's name or rights."};
inline constexpr AlarmSpec kDuplicateDriver = {201, kBus, kCritical, "duplicate_driver",
                                               "Two drivers publish this device. Stop one of them."};
inline constexpr AlarmSpec kLateReplies = {
    202, kBus, kWarning, "late_replies",
    "Raise timeout_us; set the adapter's latency timer to 1 ms; spare the computer."};
inline constexpr AlarmSpec kUnexpectedBytes = {
    203, kBus, kWarning, "unexpected_bytes",
    "Look for a second master, an address used twice, an adapter that echoes."};
// Of a CAN bus. BUS: last_error contains the command to type on this machine.
inline constexpr AlarmSpec kCanBusOff = {210, kBus, kError, "can_bus_off",
                                         "See BUS: last_error. Correct wiring or bit rate; restart the interface."};
inline constexpr AlarmSpec kCanUnacknowledged = {
    211, kBus, kError, "can_unacknowledged",
    "No node answers: check its supply, the cable and the bit rate of both."};
inline constexpr AlarmSpec kCanQueueFull = {212, kBus, kWarning, "can_queue_full",
                                            "Bus dead or too busy: see BUS; or ip link set ... txqueuelen 100."};
inline constexpr AlarmSpec kCanBusErrors = {213, kBus, kWarning, "can_bus_errors",
                                            "Check bit rate, wiring, and 120 ohm at both ends of the cable."};
inline constexpr AlarmSpec kCanErrorPassive = {214, kBus, kWarning, "can_error_passive",
                                               "Check bit rate, wiring, and 120 ohm at both ends of the cable."};
inline constexpr AlarmSpec kCanFramesLost = {
    215, kBus, kWarning, "can_frames_lost",
    "Bus too busy for this computer: see BUS; set realtime: priority, or spare load."};
inline constexpr AlarmSpec kCanErrorWarning = {
    216, kBus, kInfo, "can_error_warning", "Errors on the bus: check wiring and termination before it gets worse."};

}  // namespace runtime_alarms

// Of the bridge, on ALARM/bridge.
namespace bridge_alarms {
using namespace alarm_codes;

inline constexpr AlarmSpec kUnauthorizedCommands = {
    300, kBridge, kWarning, "foreign_commands",
    "Unauthorized commands arrive: see the bridge's log; check the network."};
inline constexpr AlarmSpec kJournalFails = {
    301, kBridge, kError, "journal_fails",
    "Commands with effect are refused: see the bridge's log; make room on the disk."};
inline constexpr AlarmSpec kUnsignedAllowed = {
    302, kBridge, kInfo, "unsigned_allowed",
    "Anybody on the network may command: axlecast keygen, unsigned_commands: refuse."};
inline constexpr AlarmSpec kEncoderExchanged = {
    303, kBridge, kError, "encoder_exchanged",
    "Another encoder answers: see axlecast history --events; axlecast replace DEVICE."};
inline constexpr AlarmSpec kPlaceDoubtful = {
    304, kBridge, kWarning, "place_doubtful",
    "It moved unseen, far: axlecast history --events; check its place, home it."};
inline constexpr AlarmSpec kKeyMissing = {
    305, kBridge, kError, "key_missing",
    "The bridge cannot sign: see its log; drivers and clients do not obey it."};
inline constexpr AlarmSpec kOtherBridge = {306, kBridge, kCritical, "other_bridge",
                                           "Two bridges serve one command port: stop one of them."};
inline constexpr AlarmSpec kOtherMachine = {
    307, kBridge, kWarning, "other_machine",
    "Two machines use one LCM group: axlecast doctor states what to change."};

}  // namespace bridge_alarms

// Of a recorder, on ALARM/recorder/<name>.
namespace recording_alarms {
using namespace alarm_codes;

inline constexpr AlarmSpec kDiskFull = {
    400, kRecorder, kError, "disk_full",
    "Free some space on the logs' disk now: what comes waits in memory, then is lost."};
inline constexpr AlarmSpec kDiskFails = {
    401, kRecorder, kError, "disk_fails",
    "The log is not written, or not kept: see last_error of RECORDER; check the disk."};
inline constexpr AlarmSpec kMessagesLost = {
    402, kRecorder, kWarning, "messages_lost",
    "Messages are missing: RECORDER names the senders; raise net.core.rmem_max."};
inline constexpr AlarmSpec kLogsNotShipped = {
    403, kRecorder, kWarning, "logs_not_shipped",
    "Logs exceed quota or keep, but wait: check axlecast ship and its database."};
inline constexpr AlarmSpec kLogDeletedUnshipped = {
    404, kRecorder, kError, "log_deleted_unshipped",
    "The disk is nearly full: logs went before they were shipped, see holes.jsonl."};

}  // namespace recording_alarms

// Of axlecast mqtt, on ALARM/mqtt/<machine>.
namespace mqtt_alarms {
using namespace alarm_codes;

inline constexpr AlarmSpec kBrokerAway = {
    500, kMqtt, kWarning, "broker_away",
    "No connection to the MQTT broker: see the log of axlecast mqtt for the cause."};
inline constexpr AlarmSpec kMessagesShed = {
    501, kMqtt, kWarning, "mqtt_messages_shed",
    "What waits for the broker exceeds mqtt.queue: the oldest positions are shed."};
inline constexpr AlarmSpec kMessagesRefused = {502, kMqtt, kWarning, "mqtt_refused",
                                               "The broker refuses messages: check its access list and limits."};

}  // namespace mqtt_alarms

// Of axlecast ship, on ALARM/ship/<machine>.
namespace shipping_alarms {
using namespace alarm_codes;

inline constexpr AlarmSpec kDatabaseAway = {
    600, kShip, kWarning, "database_away",
    "The fleet database accepts nothing: see the log of axlecast ship for the cause."};
inline constexpr AlarmSpec kLogsNotShipped = {
    601, kShip, kWarning, "logs_not_shipped",
    "Logs wait for the database for over 10 min: see the log of axlecast ship."};
inline constexpr AlarmSpec kHoleRecorded = {
    602, kShip, kWarning, "hole_recorded",
    "Messages will never be in the database: axlecast fleet status names the cause."};
inline constexpr AlarmSpec kShipperFenced = {
    603, kShip, kError, "shipper_fenced",
    "Another shipper has taken this machine over: stop one of them, start this one."};

}  // namespace shipping_alarms

}  // namespace axlecast
