#pragma once

#include <iostream>
#include <mutex>
#include <streambuf>
#include <string>
#include <string_view>

#include "platform/os/descriptor.h"

namespace axlecast {

// Passes TerminalText on to another buffer.
class TerminalBuffer final : public std::streambuf {
 public:
  explicit TerminalBuffer(std::streambuf* to) : to_(to) {}
  ~TerminalBuffer() override;
  TerminalBuffer(const TerminalBuffer&) = delete;
  TerminalBuffer& operator=(const TerminalBuffer&) = delete;

 protected:
  int_type overflow(int_type character) override;
  std::streamsize xsputn(const char* text, std::streamsize size) override;
  int sync() override { return to_->pubsync(); }

 private:
  bool Pass(std::string_view text);

  std::streambuf* to_;
  std::mutex mutex_;        // std::cerr takes lines of any thread
  std::string unfinished_;  // the beginning of a character
};

// While this object exists, everything written to std::cout and std::cerr passes TerminalText. Texts from messages, logs, files
// and command lines therefore cannot control the terminal. Create one in main().
class TerminalOutput {
 public:
  TerminalOutput();
  ~TerminalOutput();
  TerminalOutput(const TerminalOutput&) = delete;
  TerminalOutput& operator=(const TerminalOutput&) = delete;

 private:
  std::streambuf* out_;
  std::streambuf* err_;
  TerminalBuffer safe_out_;
  TerminalBuffer safe_err_;
};

// A control sequence of our own to standard error, past TerminalOutput.
void SteerTerminal(std::string_view sequence);

// The keyboard, key by key: while it lives the terminal on standard input hands over every key at once and echoes none.
// Ctrl-C, Ctrl-\ and Ctrl-Z keep their meaning. One at a time in a process. However the process ends or stops, the
// terminal is as it was before (SIGKILL aside); when it continues after Ctrl-Z, keys are read again.
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
