#include "bridge/access/admission.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <optional>
#include <utility>

#include "core/base/text.h"

namespace axlecast {
namespace {

using S = command_status_t;

constexpr std::int32_t kMaxValidMs = 3'600'000;
constexpr MonoNs kClockSlack = kSecond;  // between a client's reckoning and this clock

Result<> CheckForm(const command_body_t& body) {
  if (body.mode < command_body_t::MODE_EXECUTE || body.mode > command_body_t::MODE_CANCEL) {
    return Failure("mode " + std::to_string(body.mode) + " does not exist", S::REASON_UNSUPPORTED_MODE);
  }
  if (body.valid_ms < 1 || body.valid_ms > kMaxValidMs) {
    return Failure("valid_ms is " + std::to_string(body.valid_ms) + ": give 1 to 3600000", S::REASON_MALFORMED);
  }
  if (body.arguments.size() > kMaxArguments) return Failure("more than 16 arguments", S::REASON_MALFORMED);
  if (body.reason.size() > kReasonBytes) return Failure("reason is longer than 160 bytes", S::REASON_MALFORMED);
  return {};
}

Result<> CheckTime(const command_body_t& body, MonoNs begin_by, MonoNs now) {
  if (body.issued_mono_ns > now + kClockSlack) {
    return Failure("issued_mono_ns lies ahead: it is mono_ns of a status of this bridge plus the time since",
                   S::REASON_MALFORMED);
  }
  if (now < begin_by) return {};
  return Failure("its time was over when it came: nothing was done", S::REASON_DEADLINE);
}

std::string DeviceNames(const MachineConfig& machine) {
  std::string text = "devices of " + machine.machine + ":";
  for (const BusConfig& bus : machine.buses) {
    for (const DeviceConfig& device : bus.devices) text += " " + device.name;
  }
  return text;
}

bool SameArguments(const std::vector<argument_t>& one, const std::vector<argument_t>& other) {
  return std::equal(one.begin(), one.end(), other.begin(), other.end(),
                    [](const auto& a, const auto& b) { return a.key == b.key && a.value == b.value; });
}

tl::unexpected<Error> Unfit(const char* text) { return Failure(text, S::REASON_TOKEN); }

}  // namespace

Result<ValidatedCommand> ValidateCommand(const MachineConfig& machine, std::int64_t bridge_boot_id,
                                         const Authority& authority, const Caller& caller,
                                         const command_body_t& body, MonoNs now) {
  // A cancellation can only end the command of its own id: it may come after a restart of the bridge.
  if (body.mode != command_body_t::MODE_CANCEL && body.bridge_boot_id != bridge_boot_id) {
    return Failure(
        "it is meant for another boot of the bridge: ask for the state of the "
        "device, then send it again under a new id",
        S::REASON_STALE_BRIDGE);
  }
  if (Result<> checked = CheckForm(body); !checked) return Failure(checked.error());
  const BusConfig* bus = machine.BusOf(body.device);
  if (bus == nullptr) return Failure("no such device; " + DeviceNames(machine), S::REASON_UNKNOWN_DEVICE);
  const OperationSpec* operation = FindOperation(*bus->family, body.operation);
  if (operation == nullptr || operation->internal) {
    return Failure("no such operation; " + OperationNames(*bus->family), S::REASON_UNKNOWN_OPERATION);
  }
  if (Result<> checked = CheckArguments(*operation, body.arguments); !checked) return Failure(checked.error());
  const MonoNs begin_by = body.issued_mono_ns + body.valid_ms * kMillisecond;
  const ValidatedCommand validated{bus, operation, begin_by};
  if (body.mode == command_body_t::MODE_CANCEL) return validated;
  if (Result<> checked = authority.Check(caller, body.device, *operation); !checked)
    return Failure(checked.error());
  if (Result<> checked = CheckTime(body, begin_by, now); !checked) return Failure(checked.error());
  return validated;
}

void PreparedCommands::Issue(const Token& token, Prepared prepared, MonoNs now) {
  entries_.push_back({token, std::move(prepared), now + kValid});
  if (entries_.size() > kMax) entries_.pop_front();
}

Result<std::int32_t> PreparedCommands::Redeem(const command_body_t& body, const std::string& who, MonoNs now) {
  const auto found = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) {
    return std::equal(entry.token.begin(), entry.token.end(), std::begin(body.token));
  });
  if (found == entries_.end()) {
    return Unfit("no such token: it was used, was forgotten, or is of another boot of the bridge; prepare again");
  }
  const Entry entry = std::move(*found);
  entries_.erase(found);
  const Prepared& prepared = entry.prepared;
  if (now > entry.until) return Unfit("the token was valid for 30 s: prepare again, look, and commit sooner");
  if (prepared.who != who) return Unfit("the token belongs to another key: who prepares it commits it");
  if (prepared.device != body.device || prepared.operation != body.operation ||
      !SameArguments(prepared.arguments, body.arguments)) {
    return Unfit("something else was prepared: give the same device, operation and arguments");
  }
  return prepared.epoch;
}

}  // namespace axlecast
