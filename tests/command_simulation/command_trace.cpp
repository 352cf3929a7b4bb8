#include "tests/command_simulation/command_trace.h"

#include <algorithm>
#include <axlecast/driver_command_t.hpp>
#include <axlecast/driver_order_t.hpp>

#include "core/command/commands.h"
#include "core/messages/enum_names.h"

namespace axlecast {
namespace {

using S = command_status_t;

// NumberedId(n) is command n - 1. "-" for an id of the bridge itself.
std::string NumberOf(const CommandId& id) {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < 4; ++i) number |= static_cast<std::uint32_t>(id[i]) << (8 * i);
  const bool own = std::any_of(id.begin() + 4, id.end(), [](std::uint8_t byte) { return byte != 0; });
  return own || number == 0 ? "-" : std::to_string(number - 1);
}

const char* KindName(std::int8_t kind) {
  switch (kind) {
    case driver_order_t::KIND_EXECUTE:
      return "execute";
    case driver_order_t::KIND_CANCEL:
      return "cancel";
    case driver_order_t::KIND_QUERY:
      return "query";
    default:
      return "prepare";
  }
}

}  // namespace

void CommandTrace::Add(std::string_view event, const CommandId& id, std::string_view word) {
  std::string line = std::string(event) + " " + NumberOf(id);
  if (!word.empty()) line += " " + std::string(word);
  lines_.push_back(std::move(line));
}

void CommandTrace::DriverStarted(std::int64_t boot_id) {
  const std::size_t number = drivers_.size() + 1;
  drivers_[boot_id] = number;
  if (number > 1) lines_.emplace_back("driver_killed");
}

std::string CommandTrace::Driver(std::int64_t boot_id) const { return std::to_string(drivers_.at(boot_id)); }

bool CommandTrace::IsFirst(std::string_view event, const CommandId& id, std::int64_t value) {
  return NumberOf(id) != "-" && written_.emplace(event, id, value).second;
}

void CommandTrace::Routed(const S& status) { Add("routed", IdOf(status.id), Driver(status.driver_boot_id)); }

void CommandTrace::Outcome(const S& status) {
  const CommandId id = IdOf(status.id);
  if (IsFirst("outcome", id, status.state)) Add("outcome", id, StateName(status.state));
  if (status.finding != S::FINDING_NONE) Add("finding", id, FindingName(status.finding));
}

void CommandTrace::OnMessage(const std::string& channel, Bytes message) {
  if (channel.starts_with("DRIVER_COMMAND/")) OnOrder(message);
  if (channel.starts_with("DRIVER_STATUS/")) OnDriverStatus(message);
  if (channel == "COMMAND_STATUS") OnStatus(message);
}

void CommandTrace::OnOrder(Bytes message) {
  const auto envelope = DecodeMessage<driver_command_t>(message);
  const auto order = envelope ? DecodeMessage<driver_order_t>(envelope->order) : std::nullopt;
  if (!order) return;
  lines_.push_back(std::string("order ") + KindName(order->kind) + " " + NumberOf(IdOf(order->id)) + " " +
                   std::to_string(order->bridge_boot_id) + " " + std::to_string(order->bridge_epoch) + " " +
                   Driver(order->driver_boot_id));
}

// Only the first status of each state counts. An answer to a replaced bridge is not a state of the command.
void CommandTrace::OnDriverStatus(Bytes message) {
  const auto status = DecodeMessage<driver_status_t>(message);
  if (!status || status->kind != driver_status_t::KIND_STATUS || status->reason_code == S::REASON_FENCED) return;
  const CommandId id = IdOf(status->id);
  if (status->state == S::STATE_UNKNOWN || !IsFirst(Driver(status->boot_id), id, status->state)) return;
  if (status->state == S::STATE_ROUTED) return Add("begun", id);
  if (status->state == S::STATE_RUNNING) return Add("taken", id);
  Add("reported", id, StateName(status->state));
}

// A refusal for another boot of the bridge is no outcome.
void CommandTrace::OnStatus(Bytes message) {
  const auto status = DecodeMessage<S>(message);
  if (!status || status->is_final == 0 || status->reason_code == S::REASON_STALE_BRIDGE) return;
  const CommandId id = IdOf(status->id);
  if (IsFirst("published", id, status->state)) Add("published", id, StateName(status->state));
}

bool TracedStore::Accepted(const CommandRecord& record, Timestamp now) {
  const bool written = MemoryStore::Accepted(record, now);
  if (!written || trace == nullptr) return written;
  if (record.status.is_final != 0) {
    trace->Outcome(record.status);
  } else {
    trace->Add("accepted", IdOf(record.status.id));
  }
  return true;
}

bool TracedStore::Routed(const command_status_t& status, std::int64_t epoch, Timestamp now) {
  const bool written = MemoryStore::Routed(status, epoch, now);
  if (written && trace != nullptr) trace->Routed(status);
  return written;
}

void TracedStore::Outcome(const command_status_t& status, Timestamp now) {
  MemoryStore::Outcome(status, now);
  if (trace != nullptr) trace->Outcome(status);
}

}  // namespace axlecast
