#pragma once

#include <cstdint>
#include <string>

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

}  // namespace axlecast
