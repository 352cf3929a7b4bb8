#pragma once

#include <array>
#include <axlecast/argument_t.hpp>
#include <axlecast/command_body_t.hpp>
#include <cstdint>
#include <deque>
#include <string>
#include <variant>
#include <vector>

#include "core/base/time.h"
#include "core/command/operation_check.h"
#include "core/device/operation.h"

namespace axlecast {

using Token = std::array<std::uint8_t, 16>;

// What was prepared and may be committed: by the same key, to the same device, with the same arguments, once, for a
// short time.
class PreparedCommands {
 public:
  static constexpr MonoNs kValid = 30 * kSecond;  // to read what would happen, and to decide
  static constexpr std::size_t kMax = 64;        // the oldest goes first

  struct Prepared {
    std::string who;
    std::string device;
    std::string operation;
    std::vector<argument_t> arguments;
    std::int32_t epoch = -1;  // datum_epoch that was shown
  };

  void Issue(const Token& token, Prepared prepared, MonoNs now);
  // Takes the token of a COMMIT out, whatever the answer. The epoch that it is bound to, or why it does not fit.
  [[nodiscard]] std::variant<std::int32_t, Refusal> Redeem(const command_body_t& body, const std::string& who,
                                                           MonoNs now);

 private:
  struct Entry {
    Token token;
    Prepared prepared;
    MonoNs until;
  };
  std::deque<Entry> entries_;
};

}  // namespace axlecast
