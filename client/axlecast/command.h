// What a command asks for and how it ended. C++17; nothing of axlecast but the generated messages.
#pragma once

#include <array>
#include <axlecast/command_status_t.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace axlecast {

using CommandId = std::array<std::uint8_t, 16>;     // 128 random bits; one id acts at most once
using CommandToken = std::array<std::uint8_t, 16>;  // of a PREPARE

// An id or a token as 32 hex digits, and back.
[[nodiscard]] std::string IdText(const CommandId& id);
[[nodiscard]] std::optional<CommandId> ParseId(std::string_view text);

// A command that an operator or a program sends.
struct CommandRequest {
  std::string device;
  std::string operation;                                            // docs/commands.md, "Operations"
  std::vector<std::pair<std::string, std::string>> arguments = {};  // at most 16
  std::int32_t valid_ms = 5'000;                                    // it may begin within this time, 1..3600000
  std::int32_t expect_epoch = -1;          // refused when the device's datum_epoch differs; -1 any
  std::string reason = {};                 // for the journal, at most 160 bytes
  bool prepare = false;                    // only check what would happen; the result then contains a token
  std::optional<CommandToken> token = {};  // does what was prepared: the same device, operation and arguments
};

enum class CommandOutcome {
  kDone,            // and read back
  kDoneUnverified,  // the device confirmed it, but allows no read-back
  kPrepared,        // `prepare`: it would be done; nothing was done
  kRejected,        // nothing was done
  kExpired,         // nothing was done
  kCancelled,       // nothing was done
  kFailed,          // it may have been done in part
  kIndeterminate,   // unknown; status.finding contains the result of the later read-back
  kNotAccepted,     // no bridge took it up: nothing was done, and it can be sent again
  kUnknown,         // no outcome is known (yet): never the same as failed. Ask for the id later
};

// What is known of a command.
struct CommandResult {
  CommandId id{};
  bool answered = false;  // `status` contains the newest status from the bridge
  command_status_t
      status{};  // STATE_*, REASON_*, text, changes; its `text` is for a person. device and operation are always set
  std::string problem;        // why there is no outcome and what to do; empty when there is one
  bool not_accepted = false;  // no bridge has it and none ever will under this id: nothing was done
  bool can_resend = false;    // with not_accepted: it was nothing about the command itself
  bool prepare = false;       // it was asked what would happen
  bool under_way = false;     // the command has not ended: it is still followed, and can be awaited (again)

  [[nodiscard]] CommandOutcome outcome() const;
  // Nothing was done, and the same request may be accepted later: a busy device, a driver that is absent, a shaft that
  // turns. False when it will be refused again.
  [[nodiscard]] bool temporary() const;
  [[nodiscard]] std::string_view reason() const;  // status.reason_code as a word of docs/commands.md
  [[nodiscard]] CommandToken token() const;       // after kPrepared
};

}  // namespace axlecast
