#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

#include "platform/os/descriptor.h"

namespace axlecast {

// A program run as a child in a session of its own: the terminal's Ctrl-C does not reach it, and it is killed when
// the parent dies, however the parent dies. What it writes to standard error is read line by line.
class ChildProcess {
 public:
  ChildProcess() = default;
  ~ChildProcess();  // kills what still runs
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&&) = delete;

  // `argv` begins with the program's path; its standard output goes to the file `output`, or nowhere (-1). An empty
  // string when it runs, else why not. Call it on the main thread: the child's life is tied to the thread that
  // starts it.
  [[nodiscard]] std::string Start(const std::vector<std::string>& argv, int output);

  // Lines that have come and are complete; after the end also an unfinished one. Never waits.
  [[nodiscard]] std::vector<std::string> ReadLines();

  // How it ended ("exit code 3", "killed by signal 9 (Killed)"); nothing while it runs. Tells it once.
  struct End {
    bool clean = false;  // exit code 0
    std::string text;
  };
  [[nodiscard]] std::optional<End> Reap();

  void Signal(int signal) const;  // to it and to what it started
  [[nodiscard]] bool running() const { return pid_ > 0; }
  [[nodiscard]] pid_t pid() const { return pid_; }
  [[nodiscard]] int FileDescriptor() const { return errors_.get(); }  // readable when ReadLines has work

 private:
  pid_t pid_ = -1;
  Descriptor errors_;
  std::string partial_;
};

}  // namespace axlecast
