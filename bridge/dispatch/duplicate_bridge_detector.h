#pragma once

#include <axlecast/command_t.hpp>
#include <cstdint>
#include <optional>

#include "core/base/time.h"

namespace axlecast {

// Notices a second bridge on the command port, by the boot id in COMMAND_STATUS. A bridge asks around before it
// serves, so that the later of two gives way; should two serve in spite of that, neither takes up anything new.
class DuplicateBridgeDetector {
 public:
  static constexpr MonoNs kListen = 300 * kMillisecond;  // after the start, before it serves
  static constexpr MonoNs kForget = 10 * kSecond;        // after the other's last word

  DuplicateBridgeDetector(std::int64_t boot_id, MonoNs now)
      : boot_id_(boot_id), serves_from_(now + kListen), next_probe_(now) {}

  void OnOther(std::int64_t boot_id, MonoNs now);
  // A question (MODE_QUERY) that any bridge answers; while listening, every 100 ms.
  [[nodiscard]] std::optional<command_t> Probe(MonoNs now);

  [[nodiscard]] bool IsListening(MonoNs now) const { return now < serves_from_; }
  // Boot id of another bridge that has spoken within kForget.
  [[nodiscard]] std::optional<std::int64_t> Other(MonoNs now) const;

 private:
  const std::int64_t boot_id_;
  const MonoNs serves_from_;
  MonoNs next_probe_;
  std::int64_t other_ = 0;
  MonoNs heard_ = 0;
};

}  // namespace axlecast
