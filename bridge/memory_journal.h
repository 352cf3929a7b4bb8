#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <memory>
#include <queue>
#include <utility>
#include <vector>

#include "bridge/journal.h"

namespace axlecast {

// Remembers commands in memory. When it is full it refuses new ones rather than forget an old one.
class MemoryJournal final : public Journal {
 public:
  // About 150 bytes each: 2.3 commands a second for the 24 hours that an id is kept.
  static constexpr std::size_t kCapacity = 200'000;
  // Finished commands of which texts and changes are kept, about 1 kB each; of older ones the outcome alone.
  static constexpr std::size_t kDetailed = 4'096;

  explicit MemoryJournal(std::size_t capacity = kCapacity, std::size_t detailed = kDetailed)
      : capacity_(capacity), detailed_(detailed) {}

  [[nodiscard]] bool Accepted(const command_status_t& status, MonoNs now, MonoNs keep_until) override;
  void Step(const command_status_t& status) override;
  void Outcome(const command_status_t& status) override;
  [[nodiscard]] std::optional<command_status_t> Find(const CommandId& id) const override;

 private:
  // What stays of a command for as long as its id is kept.
  struct Entry {
    std::int64_t body_digest = 0;
    std::int64_t finished_utime = 0;
    std::int32_t reason_code = 0;
    std::int8_t state = 0;
    std::int8_t verified = 0;
    std::int8_t finding = 0;
    std::int8_t is_unsigned = 0;
    std::unique_ptr<command_status_t> details;
  };
  using Expiry = std::pair<MonoNs, CommandId>;

  void Set(const command_status_t& status);
  void ForgetExpired(MonoNs now);

  const std::size_t capacity_;
  const std::size_t detailed_;
  std::map<CommandId, Entry> entries_;
  std::priority_queue<Expiry, std::vector<Expiry>, std::greater<>> expiries_;
  std::deque<CommandId> finished_;  // with details, oldest first
};

}  // namespace axlecast
