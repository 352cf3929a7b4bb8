#include "bridge/access/admission.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <utility>

#include "core/base/text.h"
#include "core/command/commands.h"
#include "core/command/keys.h"

namespace axlecast {
namespace {

using S = command_status_t;

// Every text must fit command_status_t.text; names of the machine's file have 24 bytes at most, operations too.
tl::unexpected<Error> Denied(std::string text) { return Failure(std::move(text), S::REASON_DENIED); }

std::string Hex(std::int64_t id) { return Text("%016llx", static_cast<unsigned long long>(id)); }

bool HasSignature(const command_t& envelope) {
  return std::any_of(std::begin(envelope.sig), std::end(envelope.sig), [](std::uint8_t byte) { return byte != 0; });
}

// An empty list names everything.
bool Names(const std::vector<std::string>& list, std::string_view name) {
  return list.empty() || std::find(list.begin(), list.end(), name) != list.end();
}

Result<Caller> Unsigned(const BridgeConfig& config) {
  if (config.allow_unsigned) return Caller{.who = "unsigned"};
  return Failure(config.keys.empty()
                     ? "it is not signed, and the machine's file names no key that could: docs/keys.md sets them up"
                     : "it is not signed: send it with a key of the machine's file (axlecast ... --key FILE)",
                 S::REASON_UNSIGNED);
}

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

Result<Caller> Authority::Identify(const command_t& envelope, const command_body_t& body) const {
  const bool has_signature = HasSignature(envelope);
  if (body.key_id == 0 && !has_signature) return Unsigned(config_);
  if (body.key_id == 0) return Failure("it is signed, but names no key (key_id 0)", S::REASON_BAD_SIGNATURE);
  const KeyGrant* grant = config_.FindKey(body.key_id);
  if (grant == nullptr) {
    return Failure("key " + Hex(body.key_id) +
                       " is not in the bridge's machine file: add its public half to bridge.keys and restart the "
                       "bridge (docs/keys.md)",
                   S::REASON_BAD_SIGNATURE);
  }
  if (!Verify(grant->key, Domain::kCommand, envelope.body, SignatureOf(envelope))) {
    return Failure("its signature is not of key " + grant->name + " (" + Hex(body.key_id) +
                       "): it was changed on its way, or forged",
                   S::REASON_BAD_SIGNATURE);
  }
  return Caller{.who = grant->name, .key_id = grant->id, .grant = grant};
}

Result<> Authority::Check(const Caller& caller, std::string_view device, const OperationSpec& operation) const {
  if (caller.grant == nullptr) return {};  // Identify has let it pass
  const KeyGrant& grant = *caller.grant;
  const std::string key = "key " + grant.name;
  const std::string name = CappedText(operation.name, kNameBytes);
  if (!IsAllowed(grant.role, operation)) {
    return Denied(key + " has role " + std::string(RoleName(grant.role)) + ": " + name + " needs " +
                  std::string(AllowedRoles(operation)));
  }
  if (!Names(grant.devices, device)) {
    return Denied(key + " is not for device " + CappedText(device, kNameBytes) + " (bridge.keys." + grant.name +
                  ".devices)");
  }
  if (!Names(grant.operations, operation.name)) {
    return Denied(key + " is not for operation " + name + " (bridge.keys." + grant.name + ".operations)");
  }
  return {};
}

bool Authority::MayCancel(const Caller& caller, std::string_view who_sent_it) const {
  return caller.who == who_sent_it || (caller.grant != nullptr && caller.grant->role == Role::kMaintainer);
}

Result<ValidatedCommand> ValidateCommand(const MachineConfig& machine, std::int64_t bridge_boot_id,
                                         const Authority& authority, const Caller& caller,
                                         const command_body_t& body, MonoNs now) {
  // A cancellation can only end the command of its own id: it may come after a restart of the bridge.
  if (body.mode != command_body_t::MODE_CANCEL && body.bridge_boot_id != bridge_boot_id) {
    return Failure(
        "it is meant for another boot of the bridge: ask for the state of the device, then send it again under a "
        "new id",
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
