#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "core/base/inline_bytes.h"
#include "core/base/result.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// Switches off echo, line editing and any change of bytes. Rate and character format stay. A terminal that is raw already is not
// changed: until a port is locked, it may belong to another driver.
[[nodiscard]] bool MakeRaw(int terminal);

// A mark distinguishes the line of a simulator from every other terminal. The number in /dev/pts/N does not: after a
// simulator has ended, the kernel reuses the number, and the link of a killed simulator remains. The simulator therefore
// stores a mark in the terminal, computed from its link (inode and time of creation). The mark ends with the terminal. It is
// the same in every namespace and container in which link and terminal are visible.

// Returns the mark for the last link on the way from `path` to a file; 0 if `path` is not a link.
[[nodiscard]] std::uint64_t MarkOfLink(const std::string& path);

// The mark of an open terminal, at either end; 0: it has no mark. It is stored in the window size, which a line does not
// use, and which neither libmodbus nor the settings of a line change.
[[nodiscard]] std::uint64_t ReadMark(int terminal);
[[nodiscard]] bool WriteMark(int terminal, std::uint64_t mark);

// A pseudo-terminal that simulates a serial line: a host (a driver) opens its name, and this process holds the other end.
// It is raw and non-blocking. Only this class creates ptys.
class Pty {
 public:
  Pty() = default;
  ~Pty() { Close(); }
  Pty(const Pty&) = delete;
  Pty& operator=(const Pty&) = delete;

  // Creates a pty and the link `path` to it, which replaces an existing link. The directory must exist. An open pty is
  // closed first: the host loses its line, as if the adapter were unplugged. When the link appears, the terminal is raw and
  // has the mark of the link.
  [[nodiscard]] Result<> Open(const std::string& path);
  // Ends the line, and removes the link unless another process has replaced it.
  void Close();
  [[nodiscard]] bool IsOpen() const { return master_.valid(); }
  [[nodiscard]] int FileDescriptor() const { return master_.get(); }

  // Returns true if a host has the line open. Without a host, poll reports POLLHUP at once.
  [[nodiscard]] bool HasHost() const;
  // Returns the rate that the host has set, or the one before until the host sets one; 0 if the pty is closed.
  [[nodiscard]] std::int64_t Baud() const;

  // Reads bytes of the host. Returns 0 if there are none.
  [[nodiscard]] std::size_t Read(std::span<std::uint8_t> into);
  // Returns false if not all bytes could be delivered: there is no host, or it does not read.
  [[nodiscard]] bool Write(Bytes bytes);
  // Drops what the last host has not read. Keeps what the next host has sent.
  void Discard();

 private:
  Descriptor master_;
  std::string path_;
  std::string name_;  // /dev/pts/N
};

}  // namespace axlecast
