#pragma once

#include <string>

#include "platform/os/descriptor.h"

namespace axlecast {

// The keyboard, key by key: while it lives the terminal on standard input hands over every key at once and echoes none.
// Ctrl-C, Ctrl-\ and Ctrl-Z keep their meaning. One at a time in a process. However the process ends or stops, the
// terminal is as it was before (SIGKILL aside); when it goes on after Ctrl-Z, the keys come again.
class TerminalKeys {
 public:
  TerminalKeys();
  ~TerminalKeys();
  TerminalKeys(const TerminalKeys&) = delete;
  TerminalKeys& operator=(const TerminalKeys&) = delete;

  // Whether standard input is a terminal that this process, in the foreground, may take.
  [[nodiscard]] static bool Usable();

  [[nodiscard]] int FileDescriptor() const {
    return file_.get();
  }  // readable when keys were pressed; -1: none comes
  // What was pressed, as the terminal encodes it; empty when nothing was. Never waits.
  [[nodiscard]] std::string Read();

 private:
  Descriptor file_;
  bool taken_ = false;
};

}  // namespace axlecast
