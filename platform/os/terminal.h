#pragma once

#include <iostream>
#include <mutex>
#include <streambuf>
#include <string>
#include <string_view>

#include "platform/os/descriptor.h"

namespace axlecast {

// Passes the output through TerminalText to another buffer.
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
  std::mutex mutex_;        // std::cerr is used by any thread
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

// Writes a control sequence to standard error, bypassing TerminalOutput.
void SteerTerminal(std::string_view sequence);

// Reads the keyboard key by key: while this object exists, the terminal on standard input passes every key at once, without
// echo. Ctrl-C, Ctrl-\ and Ctrl-Z keep their meaning. At most one in a process. When the process ends or stops, except by
// SIGKILL, the terminal is restored. When it continues after Ctrl-Z, keys are read again.
class TerminalKeys {
 public:
  TerminalKeys();
  ~TerminalKeys();
  TerminalKeys(const TerminalKeys&) = delete;
  TerminalKeys& operator=(const TerminalKeys&) = delete;

  // Returns true if standard input is a terminal, and this process is in its foreground.
  [[nodiscard]] static bool Usable();

  // Readable when keys were pressed; -1: no keys can come.
  [[nodiscard]] int FileDescriptor() const { return file_.get(); }
  // Returns the keys that were pressed, as the terminal encodes them, or no text. Never waits.
  [[nodiscard]] std::string Read();

 private:
  Descriptor file_;
  bool taken_ = false;
};

}  // namespace axlecast
