#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/result.h"
#include "core/base/text.h"
#include "core/base/time.h"

namespace axlecast {

using CommandId = std::array<std::uint8_t, 16>;

// One argument that an operation takes.
struct ArgumentSpec {
  std::string_view name;
  std::string_view help;  // with range and unit
  bool required = true;
};

// Keys and values, as a command carries them.
using Arguments = std::vector<std::pair<std::string, std::string>>;

// One operation of a family: named by its effect, never by its code on the wire.
struct OperationSpec {
  std::string_view name;
  std::string_view help;
  std::vector<ArgumentSpec> arguments = {};
  bool destructive = false;       // moves a datum or writes non-volatile memory: the CLI asks first
  bool needs_standstill = false;  // measured before each request
  bool needs_permit = false;      // a fresh PERMIT of the control process, unless `permit` is not_required
  bool reads_only = false;        // changes nothing: needs no journal, and an observer may send it
  bool moves_datum = false;       // moves the device's own origin: an earlier datum is invalid afterwards
  // Returns the maximum number of writes of the device's limited memory; null: none.
  std::int32_t (*writes)(const Arguments& arguments) = nullptr;
  std::string_view verification = {};  // how its effect is read back
  // The operation that reads whether this operation took effect. The bridge executes it after INDETERMINATE, with the
  // argument `after`: this operation and its arguments ("eeprom_write address=72 data=A1 05"). Its changes are the readings
  // and, if the device can decide, `finding` with reads_as_after, no_effect_seen or cannot_tell. The bridge finds an effect
  // only if the reading before was different. Outcomes that leave the effect open therefore contain the values before (same
  // keys) or, if values flicker, the `before` of `finding` (drivers/kit/command_runner.h).
  std::string_view verified_by_operation = {};
  bool urgent = false;              // has separate queues: does not wait for a running command
  bool executed_by_bridge = false;  // executed by the bridge, with operations of the driver if necessary
  bool internal = false;            // between bridge and driver only: not offered to clients
};

// An operation that the bridge has routed to this driver.
struct DriverCommand {
  CommandId id{};
  std::string operation;
  Arguments arguments;
  MonoNs begin_by = kNever;  // may begin until then
  std::int32_t expect_epoch = -1;
};

// command_status_t STATE_* of a command within the driver.
enum class CommandState : std::uint8_t {
  kRunning = 3,
  kSucceeded = 4,
  kRejected = 5,
  kFailed = 6,
  kExpired = 7,
  kCancelled = 8,
  kIndeterminate = 9,
};

struct Change {
  std::string key;
  std::string before;
  std::string after;
};

// The state or the result of a command. `reason` is a command_status_t REASON_*; `text` names the cause, the measured
// value and the remedy.
struct Outcome {
  CommandState state = CommandState::kRunning;
  std::int32_t reason = 0;
  std::string text = {};
  bool verified = false;
  float progress = 0;
  std::vector<Change> changes = {};

  [[nodiscard]] bool IsFinal() const { return state != CommandState::kRunning; }
};

[[nodiscard]] Outcome Final(CommandState state, std::int32_t reason, std::string text);
// Returns the outcome of a command that was refused before anything was sent: EXPIRED for REASON_DEADLINE, else REJECTED.
// Its text is "nothing was done: " and the error.
[[nodiscard]] Outcome RefusedOutcome(const Error& error);
// "nothing was done: " and why.
[[nodiscard]] Outcome Rejected(std::int32_t reason, std::string_view why);
[[nodiscard]] Outcome Succeeded(bool verified, std::string text);
[[nodiscard]] inline Outcome Verified(std::string text) { return Succeeded(true, std::move(text)); }

}  // namespace axlecast
