#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/log/log_event.h"

namespace axlecast {

// A log that a test writes.
class RecordedLog {
 public:
  RecordedLog& Add(std::int64_t utime, const std::string& channel, const std::string& data = "") {
    AppendEvent(bytes_, {.number = number_++,
                         .utime = utime,
                         .channel = channel,
                         .data = Bytes(reinterpret_cast<const std::uint8_t*>(data.data()), data.size())});
    return *this;
  }
  RecordedLog& AddDamage(std::size_t size) {
    bytes_.insert(bytes_.end(), size, 0x55);
    return *this;
  }

  [[nodiscard]] Bytes bytes() const { return bytes_; }
  [[nodiscard]] std::size_t size() const { return bytes_.size(); }

 private:
  std::vector<std::uint8_t> bytes_;
  std::int64_t number_ = 0;
};

[[nodiscard]] inline std::string Text(Bytes bytes) { return {bytes.begin(), bytes.end()}; }

}  // namespace axlecast
