#include "drivers/runtime/command/permit_book.h"

#include <axlecast/permit_body_t.hpp>
#include <axlecast/permit_t.hpp>

#include "drivers/runtime/core/decode_message.h"

namespace axlecast {
namespace {

constexpr std::int32_t kMaxValidMs = 500;
constexpr std::int8_t kMaxOperations = 24;

}  // namespace

PermitBook::PermitBook(const BusConfig& bus) {
  for (const DeviceConfig& device : bus.devices) devices_[device.name].required = device.permit_required;
}

void PermitBook::Accept(std::string_view device, Bytes message, MonoNs now) {
  const auto envelope = DecodeMessage<permit_t>(message);
  if (!envelope) return;
  const auto body = DecodeMessage<permit_body_t>(envelope->permit);
  if (!body || body->device != device || body->n_operations > kMaxOperations) return;
  if (body->valid_ms < 1 || body->valid_ms > kMaxValidMs) return;
  const auto found = devices_.find(device);
  if (found == devices_.end()) return;

  Permit& permit = found->second;
  const bool same_issuer = body->issuer_boot_id == permit.issuer_boot_id;
  if (same_issuer && body->issue <= permit.issue) return;
  permit.issuer_boot_id = body->issuer_boot_id;
  permit.issue = body->issue;
  permit.until = now + body->valid_ms * kMillisecond;
  permit.operations = {body->operations.begin(), body->operations.end()};
}

bool PermitBook::Holds(std::string_view device, std::string_view operation, MonoNs now) const {
  const auto found = devices_.find(device);
  if (found == devices_.end()) return false;
  const Permit& permit = found->second;
  return !permit.required || (now < permit.until && permit.operations.contains(operation));
}

}  // namespace axlecast
