#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "platform/os/descriptor.h"

namespace axlecast {

// The folder that this program stands in: its companions stand there too.
[[nodiscard]] std::string ProgramFolder();
[[nodiscard]] std::string CompanionProgram(std::string_view name);      // <folder>/axlecast-<name>
[[nodiscard]] std::string DriverProgram(std::string_view family_name);  // of a family's buses

// Becomes the program; returns only when that fails, with the reason.
[[nodiscard]] std::string Become(const std::vector<std::string>& argv);

// As one would type it in a shell.
[[nodiscard]] std::string ShellText(const std::vector<std::string>& argv);

// This host's name; empty where it has none.
[[nodiscard]] std::string HostName();

// The log of one process: a file of at most kLimit bytes, and the one before it as <path>.1.
class ProcessLog {
 public:
  static constexpr std::int64_t kLimit = 8'000'000;

  explicit ProcessLog(std::string path, std::int64_t limit = kLimit);

  // Adds a line. A disk that is full or a directory that is gone loses the line, never the process.
  void Write(std::string_view line);
  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] int FileDescriptor() const { return file_.get(); }  // for a process that writes by itself; or -1

 private:
  void Open();

  std::string path_;
  std::int64_t limit_;
  Descriptor file_;
  std::int64_t size_ = 0;
};

// Whether an operator should see a line of standard error at once: all but those that our logs mark, among their
// first words, as info or below. Lines without a mark come from a crash, the loader or a bad option.
[[nodiscard]] bool WorthShowing(std::string_view line);

}  // namespace axlecast
