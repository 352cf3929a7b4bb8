#pragma once

#include <array>
#include <axlecast/command_status_t.hpp>
#include <cstddef>
#include <cstdint>
#include <deque>

namespace axlecast {

// Commands as COMMAND_STATUS tells of them, each once, by its id.
class CommandHistory {
 public:
  static constexpr std::size_t kMax = 256;
  static constexpr std::size_t kStates = 10;  // command_status_t STATE_*

  // True when it told something new. Answers about unknown ids are passed over.
  bool On(command_status_t status);

  // The newest kMax, in the order in which they were first heard of.
  [[nodiscard]] const std::deque<command_status_t>& newest() const { return newest_; }
  // Where newest() holds the command that was heard of last.
  [[nodiscard]] std::size_t last() const { return last_; }
  // Commands whose one outcome was heard, by state.
  [[nodiscard]] std::int64_t outcomes(std::int8_t state) const {
    return outcomes_.at(static_cast<std::uint8_t>(state));
  }

 private:
  std::deque<command_status_t> newest_;
  std::size_t last_ = 0;
  std::array<std::int64_t, kStates> outcomes_{};
};

}  // namespace axlecast
