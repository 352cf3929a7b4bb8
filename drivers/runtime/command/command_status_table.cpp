#include "drivers/runtime/command/command_status_table.h"

#include "core/base/text.h"
#include "core/command/commands.h"
#include "core/messages/enum_names.h"

namespace axlecast {

driver_status_t StatusOf(const driver_order_t& order) {
  driver_status_t status{};
  status.kind = driver_status_t::KIND_STATUS;
  std::copy(std::begin(order.id), std::end(order.id), std::begin(status.id));
  status.device = CappedText(order.device, kNameBytes);
  status.operation = CappedText(order.operation, kNameBytes);
  status.epoch_after = -1;
  return status;
}

CommandStatusTable::CommandStatusTable(const std::string& bus, std::int64_t boot_id, const Clock& clock,
                                       Output output, std::size_t capacity)
    : bus_(bus),
      channel_("DRIVER_STATUS/" + bus),
      boot_id_(boot_id),
      clock_(clock),
      output_(output),
      capacity_(capacity) {
  time_.Update(clock_.Now(), clock_.UtcMicroseconds());
}

CommandStatusTable::Entry* CommandStatusTable::Find(const CommandId& id) {
  const auto found = entries_.find(id);
  return found == entries_.end() ? nullptr : &found->second;
}

CommandStatusTable::Entry& CommandStatusTable::Add(const driver_order_t& order) {
  DeleteOldest();
  const CommandId id = IdOf(order.id);
  Entry& entry = entries_[id];
  oldest_first_.push_back(id);
  entry.status = StatusOf(order);
  entry.prepare = order.kind == driver_order_t::KIND_PREPARE;
  return entry;
}

void CommandStatusTable::DeleteOldest() {
  // Unfinished ones are few and go to the end of the line.
  for (std::size_t tries = oldest_first_.size(); entries_.size() >= capacity_ && tries > 0; --tries) {
    const CommandId id = oldest_first_.front();
    oldest_first_.pop_front();
    if (IsFinalState(At(id).status.state)) {
      entries_.erase(id);
    } else {
      oldest_first_.push_back(id);
    }
  }
}

void CommandStatusTable::Publish(Entry& entry) {
  Send(entry.status);
  entry.published = entry.status.mono_ns;
}

void CommandStatusTable::End(Entry& entry, std::int8_t state, std::int32_t reason, const std::string& text) {
  entry.status.state = state;
  entry.status.reason_code = reason;
  entry.status.text = CappedText(text, kTextBytes);
  entry.status.finished_utime = UnixUs();
  entry.command = {};
  Publish(entry);
}

void CommandStatusTable::Send(driver_status_t& status) {
  const MonoNs now = clock_.Now();
  time_.Update(now, clock_.UtcMicroseconds());
  status.mono_ns = now;
  status.utime = time_.Utime(now);
  status.boot_id = boot_id_;
  status.seq = seq_++;
  status.bus = bus_;
  status.bridge_epoch = bridge_epoch_;
  if (output_.key != nullptr) SignMessage(*output_.key, Domain::kDriver, status);
  axlecast::Publish(*output_.sink, channel_, status);
}

}  // namespace axlecast
