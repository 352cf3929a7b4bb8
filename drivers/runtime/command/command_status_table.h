#pragma once

#include <axlecast/driver_order_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <string>

#include "core/base/time.h"
#include "core/command/keys.h"
#include "core/device/operation.h"
#include "core/messages/message.h"

namespace axlecast {

// The commands of this boot of a driver, and their statuses on the channel DRIVER_STATUS.
class CommandStatusTable {
 public:
  struct Entry {
    driver_status_t status{};
    DriverCommand command;  // until it is finished
    bool prepare = false;   // KIND_PREPARE
    MonoNs published = 0;   // last
  };

  struct Output {
    MessageSink* sink;
    const SigningKey* key;  // null: statuses are unsigned
  };
  // Stores at most `capacity` ids. The oldest finished id is deleted first.
  CommandStatusTable(const std::string& bus, std::int64_t boot_id, const Clock& clock, Output output,
                     std::size_t capacity);

  [[nodiscard]] Entry* Find(const CommandId& id);
  [[nodiscard]] Entry& At(const CommandId& id) { return entries_.at(id); }
  Entry& Add(const driver_order_t& order);

  void Publish(Entry& entry);
  // Sets and publishes the final state of a command.
  void End(Entry& entry, std::int8_t state, std::int32_t reason, const std::string& text);
  // Completes the header, signs and publishes.
  void Send(driver_status_t& status);

  [[nodiscard]] MonoNs Now() const { return clock_.Now(); }
  [[nodiscard]] std::int64_t UnixUs() const { return time_.Utime(clock_.Now()); }
  void set_bridge_epoch(std::int64_t newest) { bridge_epoch_ = newest; }

 private:
  void DeleteOldest();

  const std::string bus_;
  const std::string channel_;
  const std::int64_t boot_id_;
  const Clock& clock_;
  const Output output_;
  const std::size_t capacity_;

  Timebase time_;
  std::int64_t seq_ = 0;
  std::int64_t bridge_epoch_ = 0;
  std::map<CommandId, Entry> entries_;
  std::deque<CommandId> oldest_first_;
};

// Returns a status for this command. The caller sets its state.
[[nodiscard]] driver_status_t StatusOf(const driver_order_t& order);

}  // namespace axlecast
