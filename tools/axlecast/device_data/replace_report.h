#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/axlecast/command.h"
#include "core/base/time.h"

namespace axlecast {

// Steps of an exchange, in order.
enum class ReplaceStep : std::uint8_t { kBackup, kExchange, kAccept, kWriteBack, kDatum };
inline constexpr std::string_view kReplaceSteps[] = {"backup", "exchange", "accept", "write", "datum"};

// The result of `axlecast replace` (docs/cli.md).
struct ReplaceReport {
  std::string device;
  bool has_position = true;    // false: a monitor, which has no datum
  std::string backup;          // its file, or empty
  std::string backup_problem;  // why it is missing, or empty
  std::string encoder;         // identity of the device after the exchange, or empty
  std::optional<CommandResult> accepted;
  std::vector<CommandResult> written;      // writes, in order
  std::vector<std::size_t> not_permitted;  // addresses that differ, but are not listed in the machine's file
  std::optional<CommandResult> datum;
  std::optional<ReplaceStep> stopped;  // the step that failed; empty if all are done
};

[[nodiscard]] nlohmann::ordered_json ToJson(const ReplaceReport& report);
[[nodiscard]] std::string ToText(const ReplaceReport& report);

// Returns the command that continues, or that sets the datum later. Returns "" if there is nothing to do.
[[nodiscard]] std::string NextCommand(const ReplaceReport& report);

// Detects from the state of a device that it was disconnected, and that it or another one answers again.
class ExchangeWatch {
 public:
  enum class Stage : std::uint8_t { kThere, kAway, kBack };

  // Minimum time of answers without a gap before the device counts as back.
  static constexpr MonoNs kSteady = kSecond;

  // `state`: device_info_t STATE_*, or nothing if its driver is silent. `boot_id`: of its driver, 0 if unknown. A restart of
  // the driver counts as a disconnection.
  void On(std::optional<std::int8_t> state, std::int64_t boot_id, MonoNs now);

  [[nodiscard]] Stage stage() const { return stage_; }

 private:
  Stage stage_ = Stage::kThere;
  std::int64_t boot_id_ = 0;
  MonoNs answers_since_ = kNever;
};

}  // namespace axlecast
