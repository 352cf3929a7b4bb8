#pragma once

#include <array>
#include <axlecast/argument_t.hpp>
#include <axlecast/command_body_t.hpp>
#include <axlecast/command_t.hpp>
#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "core/device/operation.h"

namespace axlecast {

// Who sent a command.
struct Caller {
  std::string who;  // the key's name; "unsigned" without one
  std::int64_t key_id = 0;
  const KeyGrant* grant = nullptr;  // null: unsigned
};

// Judges by the keys of the machine's file who sends a command, and what its sender may do. Refusals are for the
// sender: they contain nothing that is not in the machine's file, which is not secret.
class Authority {
 public:
  // `config` must outlive it and its callers.
  explicit Authority(const BridgeConfig& config) : config_(config) {}

  // The owner of a listed key whose signature of the envelope is good; or nobody, where the file allows that and
  // there is no signature. A signature is verified in any case. `body`: decoded from the envelope's.
  [[nodiscard]] Result<Caller> Identify(const command_t& envelope, const command_body_t& body) const;

  // Why the caller may not have the device do the operation; nothing when it may.
  [[nodiscard]] Result<> Check(const Caller& caller, std::string_view device, const OperationSpec& operation) const;

  // Whether the caller may cancel a command of `who_sent_it` (Caller::who): its own, or as a maintainer any.
  [[nodiscard]] bool MayCancel(const Caller& caller, std::string_view who_sent_it) const;

 private:
  const BridgeConfig& config_;
};

using Token = std::array<std::uint8_t, 16>;

// A command that this bridge may take up: where it goes and what it does.
struct ValidatedCommand {
  const BusConfig* bus = nullptr;
  const OperationSpec* operation = nullptr;
  MonoNs begin_by = 0;
};

// Checks the content of a command (any mode but QUERY) and the rights of its sender. The result of the same command does
// not change while the bridge runs, so refusals are not stored.
[[nodiscard]] Result<ValidatedCommand> ValidateCommand(const MachineConfig& machine, std::int64_t bridge_boot_id,
                                                       const Authority& authority, const Caller& caller,
                                                       const command_body_t& body, MonoNs now);

// What was prepared and may be committed: by the same key, to the same device, with the same arguments, once, for a
// short time.
class PreparedCommands {
 public:
  static constexpr MonoNs kValid = 30 * kSecond;  // to read what would happen, and to decide
  static constexpr std::size_t kMax = 64;         // the oldest goes first

  struct Prepared {
    std::string who;
    std::string device;
    std::string operation;
    std::vector<argument_t> arguments;
    std::int32_t epoch = -1;  // datum_epoch that was shown
  };

  void Issue(const Token& token, Prepared prepared, MonoNs now);
  // Takes the token of a COMMIT out, whatever the answer. The epoch that it is bound to, or why it does not fit.
  [[nodiscard]] Result<std::int32_t> Redeem(const command_body_t& body, const std::string& who, MonoNs now);

 private:
  struct Entry {
    Token token;
    Prepared prepared;
    MonoNs until;
  };
  std::deque<Entry> entries_;
};

// Counts commands and statuses that may not act, so that a flood raises one alarm and a line in the log now and then.
class UnauthorizedMessageCounter {
 public:
  static constexpr MonoNs kRecent = 60 * kSecond;  // how long one keeps the alarm up
  static constexpr MonoNs kLogInterval = 10 * kSecond;
  static constexpr int kAnswersPerSecond = 100;

  // Returns true if this message should be logged (at most once in kLogInterval).
  bool Count(MonoNs now) {
    ++count_;
    last_ = now;
    any_ = true;
    if (logged_ != 0 && now - logged_ < kLogInterval) return false;
    logged_ = now;
    return true;
  }
  // Returns whether the message may be answered, so that a flood does not cause a flood of answers.
  [[nodiscard]] bool MayAnswer(MonoNs now) {
    if (now - answers_from_ >= kSecond) {
      answers_from_ = now;
      answers_ = 0;
    }
    return ++answers_ <= kAnswersPerSecond;
  }
  [[nodiscard]] std::int64_t count() const { return count_; }
  [[nodiscard]] bool Recent(MonoNs now) const { return any_ && now - last_ < kRecent; }

 private:
  std::int64_t count_ = 0;
  MonoNs last_ = 0;
  MonoNs logged_ = 0;
  bool any_ = false;
  MonoNs answers_from_ = 0;
  int answers_ = 0;
};

}  // namespace axlecast
