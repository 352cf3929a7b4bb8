#pragma once

#include <deque>
#include <functional>
#include <string>

#include "platform/os/descriptor.h"

namespace axlecast {

// A local socket of mode 0600 on which another process of the same user asks one question and gets one answer.
class ControlSocket {
 public:
  using Handler = std::function<std::string(const std::string& question)>;

  ControlSocket() = default;
  ~ControlSocket();
  ControlSocket(const ControlSocket&) = delete;
  ControlSocket& operator=(const ControlSocket&) = delete;

  // Takes the path over from a process that has gone; whoever calls makes sure that none lives. An empty string
  // when it listens, else the cause and the remedy.
  [[nodiscard]] std::string Listen(const std::string& path);
  // Readable when Serve has work.
  [[nodiscard]] int FileDescriptor() const { return events_.get(); }
  // Answers the questions that have come, without waiting for any.
  void Serve(const Handler& handler);

 private:
  void Accept();

  std::string path_;
  Descriptor events_;
  Descriptor listener_;
  std::deque<Descriptor> callers_;
};

// Asks the process that listens at `path`; an empty answer when none does or it stays silent for 2 s.
[[nodiscard]] std::string AskControlSocket(const std::string& path, const std::string& question);

}  // namespace axlecast
