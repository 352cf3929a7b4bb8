#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// Programs: their files, how to start them, and their logs.

// Returns the folder of this program, which also contains its companions.
[[nodiscard]] std::string ProgramFolder();
[[nodiscard]] std::string CompanionProgram(std::string_view name);      // <folder>/axlecast-<name>
[[nodiscard]] std::string DriverProgram(std::string_view family_name);  // driver of a family

// Replaces this process by the program. Returns only on failure.
[[nodiscard]] Error Become(const std::vector<std::string>& argv);

// Returns the arguments for execv. They are valid as long as `argv`.
[[nodiscard]] std::vector<char*> ArgumentPointers(const std::vector<std::string>& argv);

// Formats how a process ended, from the status of waitpid: "exit code 3", "killed by signal 9 (Killed)".
[[nodiscard]] std::string ExitText(int status);

// Returns the name of this host, or an empty text.
[[nodiscard]] std::string HostName();

// Returns the name of this host in the machine file: `given`, or if it is empty the host name up to the first dot.
[[nodiscard]] std::string ThisHost(const std::string& given);

// The log of one process: a file of at most kLimit bytes, and the previous file as <path>.1.
class ProcessLog {
 public:
  static constexpr std::int64_t kLimit = 8'000'000;

  explicit ProcessLog(std::string path, std::int64_t limit = kLimit);

  // Adds a line. If the disk is full or the directory is gone, the line is lost.
  void Write(std::string_view line);
  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] int FileDescriptor() const {
    return file_.get();
  }  // for a process that writes to the file itself; or -1

 private:
  void Open();

  std::string path_;
  std::int64_t limit_;
  Descriptor file_;
  std::int64_t size_ = 0;
};

// Returns true if an operator should see this line of standard error immediately. Only lines of our logs with level info or
// below are not shown. Lines without a level come from a crash, the loader or a bad option.
[[nodiscard]] bool WorthShowing(std::string_view line);

}  // namespace axlecast
