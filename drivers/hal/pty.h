#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "core/base/inline_bytes.h"
#include "core/base/result.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// What tells the line of a simulator from every other terminal. The number in /dev/pts/N does not: the kernel gives it
// to the next terminal as soon as a simulator has ended, and the link to it can outlive a simulator that was killed.
// So the simulator writes a mark into the terminal itself, computed from the link that it made (its inode and the
// time it was created). The mark ends with the terminal, whatever ends the simulator, and it is the same in every
// namespace and container from which link and terminal can be seen.

// The mark that belongs to the last link on the way from `path` to a file; 0 when `path` is no link.
[[nodiscard]] std::uint64_t MarkOfLink(const std::string& path);

// The mark of an open terminal, at either end; 0: it has none. It stands in the window size, which means nothing on a
// line, and which neither libmodbus nor any setting of a line changes.
[[nodiscard]] std::uint64_t ReadMark(int terminal);
[[nodiscard]] bool WriteMark(int terminal, std::uint64_t mark);

// A pseudo terminal that stands for a serial line: a host (a driver) opens its name, we hold the other end. Raw,
// both ways without waiting. The only place that creates ptys.
class Pty {
 public:
  Pty() = default;
  ~Pty() { Close(); }
  Pty(const Pty&) = delete;
  Pty& operator=(const Pty&) = delete;

  // Creates one and links it under `path`, in place of what was linked there; the directory exists. The error
  // contains the cause and the remedy. An open one is closed first: the host loses its line, as with an
  // adapter that is pulled out. The terminal is raw before the link names it, and has the link's mark (pty_mark.h).
  [[nodiscard]] Result<> Open(const std::string& path);
  // Ends the line; the link goes if it is still ours.
  void Close();
  [[nodiscard]] bool IsOpen() const { return master_.valid(); }
  [[nodiscard]] int FileDescriptor() const { return master_.get(); }

  // Whether a host has the line open now. While none has, poll reports POLLHUP at once.
  [[nodiscard]] bool HasHost() const;
  // The rate that the host has set its end to, any number; what stood before it came until it does. 0 when closed.
  [[nodiscard]] std::int64_t Baud() const;

  // The host's bytes, at most what fits `into`; 0 when there are none.
  [[nodiscard]] std::size_t Read(std::span<std::uint8_t> into);
  // In one write. False when they could not all be delivered: no host, or one that does not read.
  [[nodiscard]] bool Write(Bytes bytes);
  // What a host that went away has not read is dropped. What the next one may have sent by now is kept.
  void Discard();

 private:
  Descriptor master_;
  std::string path_;
  std::string name_;  // /dev/pts/N
};

}  // namespace axlecast
