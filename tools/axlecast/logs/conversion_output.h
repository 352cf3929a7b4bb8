#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "platform/os/new_file.h"
#include "tools/axlecast/logs/log_selection.h"

namespace axlecast {

// Where a command writes what it makes of a log: -o FILE, or - for standard output; --force.
class ConversionOutput {
 public:
  // The object must outlive the parsing.
  void AddTo(CLI::App& command);

  // When nothing can be written there, says why on standard error and returns the exit code.
  [[nodiscard]] std::optional<int> Open();

  // False when it cannot be written.
  bool Write(std::string_view part);

  // Makes it last. Says on standard error what is wrong with it, or with the log that it was made of, and returns the
  // exit code.
  [[nodiscard]] int Keep(const LogSelection& log);

  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  [[nodiscard]] bool Flush();

  std::string path_;
  bool force_ = false;
  std::unique_ptr<NewFile> file_;  // null of standard output
  std::string waiting_;
  std::string problem_;
};

}  // namespace axlecast
