#pragma once

#include <CLI/App.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "drivers/io/mapped_file.h"
#include "tools/convert/event_range.h"
#include "tools/log/channel_filter.h"

namespace axlecast {

// The events of a log that a command is given: LOG, and of it --channel, --invert, --since, --until.
class LogSelection {
 public:
  // The object must outlive the parsing.
  void AddTo(CLI::App& command);

  // Opens the log. When it cannot be read, or an option is wrong, says why on standard error and returns the exit code.
  [[nodiscard]] std::optional<int> Open();

  // Of the opened log; they refer to this object. `all`: whatever --channel says.
  [[nodiscard]] EventRange events();
  [[nodiscard]] EventRange all();

  // Of the last walk to the end: bytes that are no event, within the chosen time.
  [[nodiscard]] std::size_t damaged_bytes() const { return damaged_bytes_; }
  [[nodiscard]] const std::string& file() const { return file_; }

 private:
  void Visit(const EventVisitor& visit, bool filtered);

  std::string file_;
  std::string channel_;
  bool invert_ = false;
  std::string since_;
  std::string until_;
  ChannelFilter filter_;
  std::optional<std::int64_t> since_utime_;
  std::optional<std::int64_t> until_utime_;
  std::unique_ptr<MappedFile> log_;
  std::size_t damaged_bytes_ = 0;
};

}  // namespace axlecast
