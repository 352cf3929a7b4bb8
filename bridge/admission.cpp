#include "bridge/admission.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <optional>

#include "drivers/runtime/command/capped_text.h"

namespace axlecast {
namespace {

using S = command_status_t;

constexpr std::int32_t kMaxValidMs = 3'600'000;

bool IsSigned(const command_t& envelope, const command_body_t& body) {
  return body.key_id != 0 ||
         std::any_of(std::begin(envelope.sig), std::end(envelope.sig), [](std::uint8_t byte) { return byte != 0; });
}

// Signatures are not verified by this version: see docs/commands.md.
std::optional<Refusal> CheckSignature(const MachineConfig& machine, const command_t& envelope,
                                      const command_body_t& body) {
  if (machine.bridge.allow_unsigned) return std::nullopt;
  if (IsSigned(envelope, body)) {
    return Refusal{
        S::REASON_BAD_SIGNATURE,
        "this version of the bridge cannot verify signatures yet; a machine that needs no authentication "
        "may set bridge: {unsigned_commands: allow}"};
  }
  return Refusal{S::REASON_UNSIGNED,
                 "unsigned; where nobody else is on the network segment, the machine's file may set "
                 "bridge: {unsigned_commands: allow}"};
}

std::optional<Refusal> CheckForm(const command_body_t& body) {
  if (body.mode == command_body_t::MODE_PREPARE || body.mode == command_body_t::MODE_COMMIT) {
    return Refusal{S::REASON_UNSUPPORTED_MODE, "this version knows no PREPARE and COMMIT: send EXECUTE"};
  }
  if (body.mode != command_body_t::MODE_EXECUTE && body.mode != command_body_t::MODE_CANCEL) {
    return Refusal{S::REASON_UNSUPPORTED_MODE, "mode " + std::to_string(body.mode) + " does not exist"};
  }
  if (body.valid_ms < 1 || body.valid_ms > kMaxValidMs) {
    return Refusal{S::REASON_MALFORMED, "valid_ms is " + std::to_string(body.valid_ms) + ": give 1 to 3600000"};
  }
  if (body.arguments.size() > kMaxArguments) return Refusal{S::REASON_MALFORMED, "more than 16 arguments"};
  if (body.reason.size() > kReasonBytes) return Refusal{S::REASON_MALFORMED, "reason is longer than 160 bytes"};
  return std::nullopt;
}

std::string DeviceNames(const MachineConfig& machine) {
  std::string text = "devices of " + machine.machine + ":";
  for (const BusConfig& bus : machine.buses) {
    for (const DeviceConfig& device : bus.devices) text += " " + device.name;
  }
  return text;
}

}  // namespace

std::variant<Admitted, Refusal> Admit(const MachineConfig& machine, std::int64_t bridge_boot_id,
                                      const command_t& envelope, const command_body_t& body) {
  if (auto refusal = CheckSignature(machine, envelope, body)) return *refusal;
  if (body.bridge_boot_id != bridge_boot_id) {
    return Refusal{S::REASON_STALE_BRIDGE,
                   "it is meant for another boot of the bridge: ask for the state of the "
                   "device, then send it again under a new id"};
  }
  if (auto refusal = CheckForm(body)) return *refusal;
  const BusConfig* bus = machine.BusOf(body.device);
  if (bus == nullptr) return Refusal{S::REASON_UNKNOWN_DEVICE, "no such device; " + DeviceNames(machine)};
  const OperationSpec* operation = FindOperation(*bus->family, body.operation);
  if (operation == nullptr || operation->internal) {
    return Refusal{S::REASON_UNKNOWN_OPERATION, "no such operation; " + OperationNames(*bus->family)};
  }
  if (auto refusal = CheckArguments(*operation, body.arguments)) return *refusal;
  return Admitted{bus, operation};
}

}  // namespace axlecast
