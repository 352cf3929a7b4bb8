#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <optional>
#include <string>

#include "tools/axlecast/logs/log_choice.h"
#include "tools/axlecast/logs/log_input.h"
#include "tools/convert/conversion.h"

namespace axlecast {

// The events of a log that a command is given: LOG, and of it --channel, --invert, --from, --until.
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
  // What became of the file meanwhile (MappedFile::Loss).
  [[nodiscard]] std::string Loss() const { return input_.file().Loss(); }
  [[nodiscard]] const std::string& file() const { return file_; }

 private:
  void Visit(const EventVisitor& visit, bool filtered);

  std::string file_;
  LogChoice choice_;
  LogInput input_;
  std::size_t damaged_bytes_ = 0;
};

}  // namespace axlecast
