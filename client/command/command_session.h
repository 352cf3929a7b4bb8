#pragma once

#include <axlecast/command_status_t.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/runtime/core/inline_bytes.h"
#include "drivers/runtime/core/instant.h"
#include "drivers/runtime/core/operation.h"

namespace axlecast {

// What a person or a program wants done.
struct CommandRequest {
  std::string device;
  std::string operation;
  std::vector<std::pair<std::string, std::string>> arguments = {};
  std::int32_t valid_ms = 5'000;   // it may begin within this time of its acceptance, 1..3600000
  std::int32_t expect_epoch = -1;  // refused when the device's datum_epoch differs; -1 any
  std::string reason = {};         // for the journal, <= 160 bytes
};

// What is known of a command at the end of a session.
struct CommandResult {
  CommandId id{};
  bool answered = false;      // `status` holds what the bridge said last
  command_status_t status{};  // STATE_*, texts, changes; final unless the session ended early
  std::string problem;        // why there is no final outcome and what to do; empty when there is one
};

// The client's side of one command, free of I/O: learns the bridge's boot id by MODE_QUERY, repeats the command
// until a status answers it, asks again when the bridge falls silent, and ends with the one final outcome or with
// "not known". It never sends a command under a second id: whatever it sends, the device does it at most once.
class CommandSession {
 public:
  static constexpr MonoNs kRepeat = 50 * kMillisecond;
  static constexpr MonoNs kAsk = 500 * kMillisecond;     // without a word about an answered command
  static constexpr MonoNs kBridgeSilence = 3 * kSecond;  // nothing from the bridge for so long: no answer

  // Executes `request` under `id` (128 random bits). Gives up at `give_up`, whatever the state.
  CommandSession(const CommandId& id, CommandRequest request, MonoNs now, MonoNs give_up);
  // Asks how the command `id` stands; sends nothing else. STATE_UNKNOWN ends it as "not known".
  static CommandSession Query(const CommandId& id, MonoNs now, MonoNs give_up);

  // From now on asks for the command to be cancelled; it still ends with the command's one outcome.
  void Cancel(MonoNs now);

  // The encoded command_body_t to send now, if any.
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> Next(MonoNs now);
  // True when the status is about this command and says something new.
  bool OnStatus(const command_status_t& status, MonoNs now);

  [[nodiscard]] bool done() const { return done_; }
  [[nodiscard]] const CommandResult& result() const { return result_; }

 private:
  enum class Phase : std::uint8_t { kLearning, kSending, kFollowing };

  CommandSession(const CommandId& id, MonoNs now, MonoNs give_up);

  [[nodiscard]] std::vector<std::uint8_t> Body(std::int8_t mode) const;
  bool Follow(const command_status_t& status, MonoNs now);
  void EndWhenHopeless(MonoNs now);
  void End(std::string problem);

  CommandRequest request_;
  CommandResult result_;
  bool only_query_ = false;
  bool cancelling_ = false;
  bool done_ = false;
  bool other_bridge_ = false;  // another boot has answered in the place of ours
  Phase phase_ = Phase::kLearning;
  std::int64_t bridge_boot_id_ = 0;
  std::int64_t digest_ = 0;  // of the body that asks for it to be done
  MonoNs next_send_ = 0;
  MonoNs heard_ = 0;  // from our bridge
  MonoNs give_up_ = kNever;
};

}  // namespace axlecast
