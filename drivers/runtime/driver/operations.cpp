#include "drivers/runtime/driver/operations.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <axlecast/device_info_t.hpp>
#include <charconv>
#include <cmath>

#include "drivers/runtime/command/command_words.h"
#include "drivers/runtime/command/operation_check.h"

namespace axlecast {
namespace {

// Beyond it a double no longer tells neighbouring counts apart, and sums could leave 64 bits.
constexpr double kLargestDatum = 9.0e15;

Outcome Rejected(std::int32_t reason, std::string text) {
  return {.state = OrderState::kRejected, .reason = reason, .text = std::move(text), .changes = {}};
}

std::optional<double> ParseNumber(std::string_view text) {
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(number)) return std::nullopt;
  if (std::abs(number) > kLargestDatum) return std::nullopt;
  return number;
}

std::string Shown(double number) {
  char text[32];
  const auto [end, error] = std::to_chars(std::begin(text), std::end(text), number);
  return error == std::errc() ? std::string(text, end) : std::string();
}

}  // namespace

bool Operations::Holds(const Target& target, const CommandId& id) {
  return std::find(target.held.begin(), target.held.end(), id) != target.held.end();
}

void Operations::Add(const DeviceConfig& config, Channel& channel, Device& device) {
  targets_.push_back({.config = &config, .channel = &channel, .device = &device, .held = {}});
}

void Operations::Poll(MonoNs now) {
  while (const auto cancel = desk_.TakeCancel()) {
    if (Target* target = Find(cancel->device)) {
      Cancel(*target, cancel->order.id, command_status_t::REASON_CANCELLED, "cancelled before it began", now);
    }
  }
  while (const auto taken = desk_.Take()) {
    if (Target* target = Find(taken->device)) Begin(*target, taken->order, now);
  }
}

void Operations::Begin(Target& target, const Order& order, MonoNs now) {
  target.held.push_back(order.id);
  log_(LogLevel::kDebug, target.config->name + ": " + order.operation + " begins, id " + IdText(order.id));
  const OperationSpec* operation = FindOperation(family_, order.operation);
  if (operation == nullptr) {
    return OnOutcome(target.config->name, order.id,
                     Rejected(command_status_t::REASON_UNKNOWN_OPERATION, OperationNames(family_)));
  }
  if (const auto refusal = Refuse(target, order, *operation)) {
    return OnOutcome(target.config->name, order.id, *refusal);
  }
  if (!IsOfRuntime(family_, *operation)) return target.device->Begin(order, now);
  if (order.operation == "set_datum") {
    return OnOutcome(target.config->name, order.id, SetDatum(target, order, now));
  }
  target.channel->OnReferenceLost();
  OnOutcome(target.config->name, order.id,
            {.state = OrderState::kSucceeded,
             .text = "the reference is marked as lost",
             .verified = true,
             .changes = {}});
}

std::optional<Outcome> Operations::Refuse(const Target& target, const Order& order,
                                          const OperationSpec& operation) const {
  const Channel::Summary now = target.channel->summary();
  if (order.expect_epoch >= 0 && order.expect_epoch != now.datum_epoch) {
    return Rejected(command_status_t::REASON_EPOCH, "datum_epoch is " + std::to_string(now.datum_epoch) + ", not " +
                                                        std::to_string(order.expect_epoch) +
                                                        ": look at the position again, then repeat");
  }
  if (operation.needs_permit && target.config->permit_required &&
      !desk_.HasPermit(target.config->name, order.operation)) {
    return Rejected(command_status_t::REASON_NO_PERMIT,
                    "no fresh PERMIT/" + target.config->name +
                        " from the control process names it; or set `permit: not_required` for this device");
  }
  // What is urgent is tried on a device that seems to be gone, too.
  if (IsOfRuntime(family_, operation) || operation.urgent) return std::nullopt;
  if (now.state == device_info_t::STATE_OFFLINE) {
    return Rejected(command_status_t::REASON_DEVICE_OFFLINE,
                    "the device is offline: see DEVICE/" + target.config->name);
  }
  if (now.state == device_info_t::STATE_STARTING) {
    return Rejected(command_status_t::REASON_DEVICE_OFFLINE, "the device is still starting: repeat it when online");
  }
  return std::nullopt;
}

Outcome Operations::SetDatum(Target& target, const Order& order, MonoNs now) const {
  const auto bad = [](const std::string& text) { return Rejected(command_status_t::REASON_BAD_ARGUMENT, text); };
  if (order.arguments.size() != 1) return bad("set_datum takes exactly one of value and counts");
  const auto& [key, text] = order.arguments.front();
  const auto number = ParseNumber(text);
  if (!number) return bad(key + " is no number within +-9e15");
  const double before = target.channel->summary().value;
  std::int64_t counts = 0;
  if (key == "counts") {
    counts = static_cast<std::int64_t>(*number);
    if (static_cast<double>(counts) != *number) return bad("counts is no whole number");
  } else {
    const auto datum = target.channel->DatumFor(*number);
    if (!datum) return Rejected(command_status_t::REASON_DEVICE_OFFLINE, "no valid position is known yet");
    counts = *datum;
  }
  target.channel->SetDatum(counts, time_.Utime(now));
  Outcome outcome{.state = OrderState::kSucceeded,
                  .text = "datum set to " + std::to_string(counts) + " counts",
                  .verified = true,
                  .changes = {}};
  if (key == "value") outcome.changes.push_back({"value", std::isnan(before) ? "" : Shown(before), Shown(*number)});
  outcome.changes.push_back({"datum_counts", "", std::to_string(counts)});
  return outcome;
}

void Operations::Cancel(Target& target, const CommandId& id, std::int32_t reason, const char* text, MonoNs now) {
  if (!Holds(target, id) || !target.device->Cancel(id, now)) return;
  OnOutcome(target.config->name, id,
            {.state = OrderState::kCancelled, .reason = reason, .text = text, .changes = {}});
}

void Operations::OnOutcome(const std::string& device, const CommandId& id, const Outcome& outcome) {
  Target* target = Find(device);
  if (target == nullptr) return;
  if (outcome.IsFinal() && std::erase(target->held, id) > 0) {
    log_(LogLevel::kInfo, device + ": id " + IdText(id) + ' ' +
                              std::string(StateName(static_cast<std::int8_t>(outcome.state))) + ": " +
                              outcome.text);
  }
  desk_.Report(device, id, outcome, target->channel->summary().datum_epoch);
}

void Operations::Abandon(MonoNs now) {
  for (Target& target : targets_) {
    const std::vector<CommandId> held = target.held;
    for (const CommandId& id : held) {
      Cancel(target, id, command_status_t::REASON_STOPPING,
             "the driver stopped before it began: send it again later", now);
    }
  }
}

bool Operations::Busy() const {
  return std::any_of(targets_.begin(), targets_.end(), [](const Target& target) { return !target.held.empty(); });
}

Operations::Target* Operations::Find(const std::string& device) {
  const auto found = std::find_if(targets_.begin(), targets_.end(),
                                  [&](const Target& target) { return target.config->name == device; });
  return found == targets_.end() ? nullptr : &*found;
}

}  // namespace axlecast
