#pragma once

#include <axlecast/alarm_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <cstdint>
#include <optional>
#include <string>

#include "bridge/state/pending_command.h"
#include "bridge/store/durable_store.h"
#include "core/alarm/alarm_table.h"
#include "core/base/time.h"
#include "core/messages/message.h"

namespace axlecast {

// Alarms of the bridge itself: docs/alarms.md. Codes never change.
namespace bridge_alarms {

inline constexpr std::uint8_t kBridge = alarm_entry_t::SOURCE_BRIDGE;

inline constexpr AlarmSpec kUnauthorizedCommands = {
    300, kBridge, alarm_entry_t::SEVERITY_WARNING, "foreign_commands",
    "Somebody sends commands that may not act: see the bridge's log; check the network."};
inline constexpr AlarmSpec kJournalFails = {
    301, kBridge, alarm_entry_t::SEVERITY_ERROR, "journal_fails",
    "Commands that change a device are refused: see the bridge's log; make room on disk."};
inline constexpr AlarmSpec kUnsignedAllowed = {
    302, kBridge, alarm_entry_t::SEVERITY_INFO, "unsigned_allowed",
    "Anybody on the network may command: axlecast keygen, unsigned_commands: refuse."};
inline constexpr AlarmSpec kEncoderExchanged = {
    303, kBridge, alarm_entry_t::SEVERITY_ERROR, "encoder_exchanged",
    "Another encoder answers: axlecast history --events; then axlecast replace DEVICE."};
inline constexpr AlarmSpec kPlaceDoubtful = {
    304, kBridge, alarm_entry_t::SEVERITY_WARNING, "place_doubtful",
    "It moved unseen, far: axlecast history --events; check its place, home it."};
inline constexpr AlarmSpec kKeyMissing = {
    305, kBridge, alarm_entry_t::SEVERITY_ERROR, "key_missing",
    "The bridge cannot sign: see its log; drivers and clients do not obey it."};
inline constexpr AlarmSpec kOtherBridge = {306, kBridge, alarm_entry_t::SEVERITY_CRITICAL, "other_bridge",
                                           "Two bridges serve one command port: stop one of them."};

}  // namespace bridge_alarms

// What of it holds at present.
struct BridgeTroubles {
  bool unauthorized_commands = false;
  bool journal_fails = false;
  bool unsigned_allowed = false;
  bool encoder_exchanged = false;
  bool place_doubtful = false;
  bool key_missing = false;
  bool other_bridge = false;
};

// ALARM/bridge on the data port: on change, at most ten times a second, and once a second.
class BridgeAlarms {
 public:
  BridgeAlarms(MessageSink& data, std::int64_t boot_id) : data_(data) { message_.boot_id = boot_id; }

  void Tick(const BridgeTroubles& troubles, Timestamp now);

 private:
  MessageSink& data_;
  AlarmTable book_;
  alarm_t message_{};
  std::int64_t published_revision_ = -1;
  MonoNs published_at_ = 0;
};

// Keeps acknowledgements and shelvings of alarms beyond the life of the driver. Returns them to a restarted driver, and
// removes those that have ended. Free of I/O but for the store.
class AlarmStateStore {
 public:
  explicit AlarmStateStore(AlarmStore& store) : store_(store) {}

  // A driver's boot is there. An order when it must be given something back; asked again until it has it all.
  [[nodiscard]] std::optional<BridgeCommand> OnHello(const std::string& device, std::int64_t boot_id,
                                                     Timestamp now);
  // KIND_ACKNOWLEDGED: an alarm that this boot knew as acknowledged and names no more has gone.
  void OnAcknowledged(const driver_status_t& status);
  // The task has its outcome. May add to the status.
  void OnOutcome(PendingCommand& task);

 private:
  void Keep(PendingCommand& task, AlarmMark::Kind kind);
  void Restored(const PendingCommand& task);

  AlarmStore& store_;
};

}  // namespace axlecast
