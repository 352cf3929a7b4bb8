#pragma once

#include <algorithm>
#include <axlecast/argument_t.hpp>
#include <axlecast/command_status_t.hpp>
#include <cstdint>
#include <iterator>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/base/inline_bytes.h"
#include "core/base/result.h"
#include "core/device/family.h"
#include "core/device/operation.h"

namespace axlecast {

// Returns the id in a message: 16 bytes.
template <typename Bytes16>
[[nodiscard]] CommandId IdOf(const Bytes16& bytes) {
  static_assert(sizeof bytes == sizeof(CommandId));
  CommandId id;
  std::copy(std::begin(bytes), std::end(bytes), id.begin());
  return id;
}

// Formats and parses an id as 32 hex digits.
[[nodiscard]] std::string IdText(const CommandId& id);
[[nodiscard]] std::optional<CommandId> ParseId(std::string_view text);

// Parses exactly `bytes.size()` bytes in hex, and nothing else.
[[nodiscard]] bool ParseHex(std::string_view text, std::span<std::uint8_t> bytes);

// Returns whether nothing more follows: the command has its outcome, and after INDETERMINATE its finding.
[[nodiscard]] inline bool IsComplete(const command_status_t& status) {
  return status.is_final != 0 && (status.state != command_status_t::STATE_INDETERMINATE ||
                                  status.finding != command_status_t::FINDING_NONE);
}

// Returns command_status_t.body_digest: the first 8 bytes, big-endian, of BLAKE2b-256 of an encoded command_body_t.
[[nodiscard]] std::int64_t BodyDigest(Bytes body);

// Returns the operations that the driver itself provides: those about alarms for every device, and those about the datum for
// every encoder. The bridge executes undo_datum and accept_exchange, the driver all others.
[[nodiscard]] std::span<const OperationSpec> RuntimeOperations(const Family& family);

// Returns the operation of that name, of the family or of RuntimeOperations; null for an unknown name.
[[nodiscard]] const OperationSpec* FindOperation(const Family& family, std::string_view name);

// Returns true for one of RuntimeOperations: it changes only the driver, and needs no device.
[[nodiscard]] bool IsOfRuntime(const Family& family, const OperationSpec& operation);

// Names of the operations about alarms.
inline constexpr std::string_view kAcknowledgeAlarm = "acknowledge_alarm";
inline constexpr std::string_view kShelveAlarm = "shelve_alarm";
inline constexpr std::string_view kUnshelveAlarm = "unshelve_alarm";
inline constexpr std::string_view kRestoreAcknowledgement = "restore_acknowledgement";
[[nodiscard]] bool IsAboutAlarms(std::string_view operation);

// Returns "operations of tformat: clear_errors, ..." without the internal ones.
[[nodiscard]] std::string OperationNames(const Family& family);

// Refuses names that the operation does not have, names that are given twice or missing, and texts beyond the limits. The
// device checks the values.
[[nodiscard]] Result<> CheckArguments(const OperationSpec& operation, std::span<const argument_t> arguments);

}  // namespace axlecast
