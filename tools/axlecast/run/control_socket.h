#pragma once

#include <deque>
#include <functional>
#include <string>

#include "core/base/result.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// A local socket of mode 0600. Another process of the same user connects, sends one question and receives one answer.
class ControlSocket {
 public:
  using Handler = std::function<std::string(const std::string& question)>;

  ControlSocket() = default;
  ~ControlSocket();
  ControlSocket(const ControlSocket&) = delete;
  ControlSocket& operator=(const ControlSocket&) = delete;

  // Replaces the socket of a process that has ended. The caller must ensure that no other process listens at `path`.
  [[nodiscard]] Result<> Listen(const std::string& path);
  // Readable if Serve has work.
  [[nodiscard]] int FileDescriptor() const { return events_.get(); }
  // Answers the received questions without waiting.
  void Serve(const Handler& handler);

 private:
  void Accept();

  std::string path_;
  Descriptor events_;
  Descriptor listener_;
  std::deque<Descriptor> callers_;
};

// Returns the answer of the process that listens at `path`; an empty text if no process listens or answers within 2 s.
[[nodiscard]] std::string AskControlSocket(const std::string& path, const std::string& question);

}  // namespace axlecast
