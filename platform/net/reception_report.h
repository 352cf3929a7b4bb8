#pragma once

#include <cstdint>
#include <string>

#include "core/base/time.h"

namespace axlecast {

// What a process's ports received of LCM's datagrams, since the start.
struct ReceptionCounts {
  std::int64_t messages = 0;   // whole ones, subscribed or not
  std::int64_t dropped = 0;    // datagrams that the kernel dropped: the process's buffer was full
  std::int64_t outside = 0;    // datagrams of other hosts, refused because the URL says ttl=0; empty ones count too
  std::int64_t malformed = 0;  // datagrams that are not LCM's

  ReceptionCounts& operator+=(const ReceptionCounts& other);
  bool operator==(const ReceptionCounts&) const = default;
};

// What must be reported of them, at most once in 10 s.
class ReceptionReport {
 public:
  static constexpr MonoNs kInterval = 10 * kSecond;

  // Cheap: something was lost or refused since the last line.
  [[nodiscard]] bool Changed(const ReceptionCounts& counts) const {
    return counts.dropped != reported_.dropped || counts.outside != reported_.outside ||
           counts.malformed != reported_.malformed;
  }

  // Empty, or one line. `remedy` is a port's warning() that its buffer is smaller than it asked for, or empty.
  [[nodiscard]] std::string Next(const ReceptionCounts& counts, MonoNs now, const std::string& remedy = "");

 private:
  ReceptionCounts reported_;
  MonoNs next_ = 0;
};

// "3 datagrams were lost because …"; empty when nothing is to be reported.
[[nodiscard]] std::string ReceptionText(const ReceptionCounts& counts, const std::string& remedy);

}  // namespace axlecast
