#pragma once

#include <axlecast/command_body_t.hpp>
#include <axlecast/command_t.hpp>
#include <cstdint>
#include <string>
#include <string_view>

#include "core/base/result.h"
#include "core/command/operation_check.h"
#include "core/config/machine_config.h"

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

}  // namespace axlecast
