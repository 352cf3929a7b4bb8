#pragma once

#include <axlecast/position_t.hpp>
#include <cstdint>
#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "tools/convert/conversion.h"

namespace axlecast {

// Events in memory; for tests.
class TestEvents {
 public:
  template <typename Message>
  void Add(std::int64_t utime, const std::string& channel, const Message& message) {
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
    message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    AddRaw(utime, channel, std::move(bytes));
  }
  void AddRaw(std::int64_t utime, std::string channel, std::vector<std::uint8_t> bytes) {
    stored_.push_back({utime, std::move(channel), std::move(bytes)});
  }

  [[nodiscard]] EventRange range() const {
    return [this](const EventVisitor& visit) {
      std::int64_t number = 0;
      for (const Stored& event : stored_) {
        const LogEvent shown{
            .number = number++, .utime = event.utime, .channel = event.channel, .data = Bytes(event.bytes)};
        if (!visit(shown)) return;
      }
    };
  }

 private:
  struct Stored {
    std::int64_t utime;
    std::string channel;
    std::vector<std::uint8_t> bytes;
  };
  std::deque<Stored> stored_;
};

// A valid reading of boot 1.
inline position_t TestPosition(std::int64_t utime, std::int64_t seq, std::int64_t counts) {
  position_t position{};
  position.utime = utime;
  position.boot_id = 1;
  position.seq = seq;
  position.counts = counts;
  position.value = static_cast<double>(counts);
  position.flags = position_t::FLAG_VALID;
  return position;
}

// Keeps what is written; takes only the first `room` parts.
struct TestOutput {
  std::string text;
  std::size_t room = SIZE_MAX;
  [[nodiscard]] Output sink() {
    return [this](std::string_view part) {
      if (room == 0) return false;
      --room;
      text += part;
      return true;
    };
  }
};

}  // namespace axlecast
