#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"

namespace axlecast {

// Another machine whose messages arrive here.
struct OtherMachine {
  std::int64_t id = 0;    // NameHash of its name
  std::string name = {};  // "" until a message that contains it has arrived: BUS, DEVICE, RECORDER or DRIVER_STATUS
  std::int64_t messages = 0;
  MonoNs last = 0;  // arrival of the newest

  bool operator==(const OtherMachine&) const = default;
};

// Separates the messages of one machine from those of others on the same LCM group and port.
class MachineFilter {
 public:
  static constexpr std::size_t kMaxOthers = 16;     // further machines are refused, but not listed
  static constexpr MonoNs kPresent = 10 * kSecond;  // since the newest message

  // `machine`: its name. Empty: all messages are taken.
  explicit MachineFilter(std::string_view machine);

  // Returns false for a message of axlecast that states another machine. Messages that state none, and messages of other LCM
  // types, are taken. Cheap. Any thread.
  [[nodiscard]] bool Takes(Bytes message) const;
  // Counts a message that was not taken. Any thread.
  void Refuse(Bytes message, MonoNs now);

  // Returns the machines whose newest message is not older than kPresent, in the order of their appearance. Any thread.
  [[nodiscard]] std::vector<OtherMachine> Others(MonoNs now) const;

 private:
  const std::int64_t own_;  // 0: all are taken
  mutable std::mutex mutex_;
  std::vector<OtherMachine> others_;
};

// Adds the count of `machine` to its entry in `machines`.
void AddMachine(std::vector<OtherMachine>& machines, const OtherMachine& machine);

// Returns `machine 'press2'`, or the machine's id if its name is not known yet; of several, a list. Empty without machines.
[[nodiscard]] std::string NamesOf(const std::vector<OtherMachine>& machines);

}  // namespace axlecast
