#include "core/command/command_words.h"

#include <array>
#include <axlecast/command_status_t.hpp>
#include <span>

namespace axlecast {
namespace {

// Indexed by the constants of command_status_t.
constexpr std::array<std::string_view, 10> kStates = {"unknown",   "accepted",     "routed", "running",
                                                      "succeeded", "rejected",     "failed", "expired",
                                                      "cancelled", "indeterminate"};
constexpr std::array<std::string_view, 4> kFindings = {"none", "effect_seen", "no_effect_seen", "cannot_tell"};
constexpr std::array<std::string_view, 36> kReasons = {"none",
                                                       "unknown_device",
                                                       "unknown_operation",
                                                       "bad_argument",
                                                       "id_reused",
                                                       "stale_bridge",
                                                       "malformed",
                                                       "bad_signature",
                                                       "unsigned",
                                                       "denied",
                                                       "queue_full",
                                                       "busy",
                                                       "driver_absent",
                                                       "not_standing_still",
                                                       "no_permit",
                                                       "epoch",
                                                       "device_offline",
                                                       "device_alarm",
                                                       "not_permitted",
                                                       "wear",
                                                       "unsupported_mode",
                                                       "journal",
                                                       "deadline",
                                                       "cancelled",
                                                       "no_reply",
                                                       "read_back_differs",
                                                       "device_refused",
                                                       "driver_restarted",
                                                       "driver_silent",
                                                       "stopping",
                                                       "wrong_identity",
                                                       "token",
                                                       "moved_during_sequence",
                                                       "fenced",
                                                       "no_datum",
                                                       "bridge_restarted"};

std::string_view Word(std::span<const std::string_view> words, std::int64_t index) {
  if (index < 0 || index >= static_cast<std::int64_t>(words.size())) return "unknown";
  return words[static_cast<std::size_t>(index)];
}

}  // namespace

std::string_view StateName(std::int8_t state) { return Word(kStates, state); }
std::string_view ReasonName(std::int32_t reason) { return Word(kReasons, reason); }
std::string_view FindingName(std::int8_t finding) { return Word(kFindings, finding); }

std::int8_t FindingOf(std::string_view word) {
  if (word == "reads_as_after") return command_status_t::FINDING_EFFECT_SEEN;
  if (word == FindingName(command_status_t::FINDING_NO_EFFECT_SEEN))
    return command_status_t::FINDING_NO_EFFECT_SEEN;
  return command_status_t::FINDING_CANNOT_TELL;
}

bool IsTemporary(std::int32_t reason) {
  switch (reason) {
    case command_status_t::REASON_STALE_BRIDGE:  // the present boot of the bridge takes it
    case command_status_t::REASON_QUEUE_FULL:
    case command_status_t::REASON_BUSY:
    case command_status_t::REASON_DRIVER_ABSENT:
    case command_status_t::REASON_NOT_STANDING_STILL:
    case command_status_t::REASON_NO_PERMIT:
    case command_status_t::REASON_DEVICE_OFFLINE:
    case command_status_t::REASON_JOURNAL:
    case command_status_t::REASON_DEADLINE:
    case command_status_t::REASON_STOPPING:
    case command_status_t::REASON_MOVED_DURING_SEQUENCE:
    case command_status_t::REASON_FENCED:
    case command_status_t::REASON_BRIDGE_RESTARTED:
      return true;
    default:
      return false;
  }
}

bool IsFinalState(std::int8_t state) {
  return state >= command_status_t::STATE_SUCCEEDED && state <= command_status_t::STATE_INDETERMINATE;
}

}  // namespace axlecast
