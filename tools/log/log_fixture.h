#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tools/log/log_event.h"
#include "tools/log/log_reader.h"

namespace axlecast {

// Writes a log for a test.
class RecordedLog {
 public:
  RecordedLog& Add(std::int64_t utime, const std::string& channel, const std::string& data = "") {
    AppendEvent(bytes_, {.number = number_++, .utime = utime, .channel = channel, .data = AsBytes(data)});
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

// Writes a log for a test: events numbered from `first`, 1 ms apart.
class ScriptedLog {
 public:
  static constexpr std::int64_t kStart = 1'790'000'000'000'000;  // us, in 2026

  explicit ScriptedLog(std::int64_t first = 0, std::int64_t start = kStart) : number_(first), utime_(start) {}

  ScriptedLog& Add(std::string_view channel, Bytes data) {
    AddNumbered(number_, channel, data);
    return *this;
  }
  ScriptedLog& Add(std::string_view channel, std::string_view data) { return Add(channel, AsBytes(data)); }
  ScriptedLog& AddNumbered(std::int64_t number, std::string_view channel, Bytes data) {
    offsets_.push_back(bytes_.size());
    AppendEvent(bytes_, {.number = number, .utime = utime_, .channel = channel, .data = data});
    number_ = number + 1;
    utime_ += 1'000;
    return *this;
  }

  [[nodiscard]] const std::vector<std::uint8_t>& bytes() const { return bytes_; }
  [[nodiscard]] const std::vector<std::size_t>& offsets() const { return offsets_; }
  [[nodiscard]] std::size_t end(std::size_t index) const {
    return index + 1 < offsets_.size() ? offsets_[index + 1] : bytes_.size();
  }

 private:
  std::vector<std::uint8_t> bytes_;
  std::vector<std::size_t> offsets_;
  std::int64_t number_;
  std::int64_t utime_;
};

// The result of reading a log.
struct ReadLog {
  std::vector<std::size_t> offsets;
  std::vector<std::int64_t> numbers;
  std::vector<LogReader::Damage> damage;
  std::size_t covered = 0;  // bytes of all events and all damage
};

inline ReadLog ReadAll(Bytes log) {
  ReadLog read;
  LogReader reader(log);
  for (auto event = reader.Next(); event; event = reader.Next()) {
    read.offsets.push_back(reader.offset());
    read.numbers.push_back(event->number);
    read.covered += EventSize(*event);
  }
  read.damage = reader.damage();
  for (const LogReader::Damage& damage : read.damage) read.covered += damage.size;
  return read;
}

}  // namespace axlecast
