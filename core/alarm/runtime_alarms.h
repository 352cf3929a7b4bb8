#pragma once

#include <axlecast/alarm_entry_t.hpp>

#include "core/device/device.h"

// Alarms that the driver itself raises, on any device of any family. Codes never change: docs/alarms.md.
namespace axlecast::runtime_alarms {

inline constexpr std::uint8_t kDriver = alarm_entry_t::SOURCE_DRIVER;
inline constexpr std::uint8_t kBus = alarm_entry_t::SOURCE_BUS;

inline constexpr AlarmSpec kDeviceOffline = {
    100, kDriver, alarm_entry_t::SEVERITY_ERROR, "device_offline",
    "See DEVICE: reason. Check the encoder's supply, cable and configuration."};
inline constexpr AlarmSpec kReferenceLost = {101, kDriver, alarm_entry_t::SEVERITY_ERROR, "reference_lost",
                                             "Move to a known place and set the datum, or reset the turns."};
inline constexpr AlarmSpec kImplausibleBurst = {
    102, kDriver, alarm_entry_t::SEVERITY_WARNING, "implausible_burst",
    "Check cable, shield and termination; check limits in the configuration."};
inline constexpr AlarmSpec kClockStepped = {103, kDriver, alarm_entry_t::SEVERITY_INFO, "clock_stepped",
                                            "UNIX time jumped. Check NTP or PTP; compare mono_ns across the step."};
inline constexpr AlarmSpec kPositionJumped = {
    104, kDriver, alarm_entry_t::SEVERITY_WARNING, "position_jumped",
    "It moved further than the shaft can. Check encoder and coupling; set the datum."};
inline constexpr AlarmSpec kTurnsPassedEnd = {
    105, kDriver, alarm_entry_t::SEVERITY_ERROR, "turns_passed_end",
    "The axis is beyond the range that `turns` allows. Move back, or reset the turns."};
inline constexpr AlarmSpec kForeignOrder = {
    106, kDriver, alarm_entry_t::SEVERITY_WARNING, "foreign_order",
    "Orders that the bridge's key did not sign: see the log; find who sends them."};

inline constexpr AlarmSpec kLinkDown = {
    200, kBus, alarm_entry_t::SEVERITY_ERROR, "link_down",
    "See DEVICE: reason. Plug the adapter in, or mend the port's name or rights."};
inline constexpr AlarmSpec kDuplicateDriver = {201, kBus, alarm_entry_t::SEVERITY_CRITICAL, "duplicate_driver",
                                               "Two drivers publish this device. Stop one of them."};

inline constexpr AlarmSpec kLateReplies = {
    202, kBus, alarm_entry_t::SEVERITY_WARNING, "late_replies",
    "Raise timeout_us; set the adapter's latency timer to 1 ms; spare the computer."};
inline constexpr AlarmSpec kUnexpectedBytes = {
    203, kBus, alarm_entry_t::SEVERITY_WARNING, "unexpected_bytes",
    "Look for a second master, an address used twice, an adapter that echoes."};

// Of a CAN bus; what to type on this machine stands in BUS: last_error.
inline constexpr AlarmSpec kCanBusOff = {210, kBus, alarm_entry_t::SEVERITY_ERROR, "can_bus_off",
                                         "See BUS: last_error. Mend wiring or bit rate; restart the interface."};
inline constexpr AlarmSpec kCanUnacknowledged = {
    211, kBus, alarm_entry_t::SEVERITY_ERROR, "can_unacknowledged",
    "No node answers: check its supply, the cable and the bit rate of both."};
inline constexpr AlarmSpec kCanQueueFull = {212, kBus, alarm_entry_t::SEVERITY_WARNING, "can_queue_full",
                                            "Bus dead or too busy: see BUS; or ip link set ... txqueuelen 100."};
inline constexpr AlarmSpec kCanBusErrors = {213, kBus, alarm_entry_t::SEVERITY_WARNING, "can_bus_errors",
                                            "Check bit rate, wiring, and 120 ohm at both ends of the cable."};
inline constexpr AlarmSpec kCanErrorPassive = {214, kBus, alarm_entry_t::SEVERITY_WARNING, "can_error_passive",
                                               "Check bit rate, wiring, and 120 ohm at both ends of the cable."};
inline constexpr AlarmSpec kCanFramesLost = {
    215, kBus, alarm_entry_t::SEVERITY_WARNING, "can_frames_lost",
    "Bus too busy for this computer: see BUS; set realtime: priority, or spare load."};
inline constexpr AlarmSpec kCanErrorWarning = {
    216, kBus, alarm_entry_t::SEVERITY_INFO, "can_error_warning",
    "Errors on the bus: check wiring and termination before it gets worse."};

}  // namespace axlecast::runtime_alarms
