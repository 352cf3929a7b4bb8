#pragma once

#include <algorithm>
#include <axlecast/driver_command_t.hpp>
#include <axlecast/driver_order_t.hpp>
#include <axlecast/permit_body_t.hpp>
#include <axlecast/permit_t.hpp>
#include <string>
#include <vector>

#include "core/command/keys.h"
#include "core/config/machine_config.h"
#include "core/device/family.h"
#include "core/messages/message.h"

namespace axlecast {

// For tests of the command path: a family whose devices count what is done to them, and its messages.

inline const Family& CountingFamily() {
  static const std::vector<OperationSpec> kOperations = {
      {.name = "bump",
       .help = "adds one to the device's count",
       .destructive = true,
       .verified_by_operation = "look"},
      {.name = "write",
       .help = "writes bytes",
       .arguments = {{"address", "0..79"}, {"bytes", "hex"}, {"note", "any", false}},
       .destructive = true},
      {.name = "mark",
       .help = "writes a note",
       .arguments = {{"note", "any"}, {"page", "1..9"}},
       .verified_by_operation = "look"},
      {.name = "halt", .help = "stops at once", .urgent = true},
      {.name = "look",
       .help = "returns the count",
       .arguments = {{"after", "an operation", false}},
       .reads_only = true},
  };
  static const Family kFamily = {.name = "counting", .summary = "for tests", .operations = kOperations};
  return kFamily;
}

inline BusConfig CountingBus(const std::string& name, const std::vector<std::string>& devices) {
  BusConfig bus;
  bus.name = name;
  bus.family = &CountingFamily();
  for (const std::string& device : devices) {
    bus.devices.emplace_back();
    bus.devices.back().name = device;
  }
  return bus;
}

// As the demo's: everything unsigned is obeyed.
inline BridgeConfig UnsignedBridge() {
  BridgeConfig bridge;
  bridge.allow_unsigned = true;
  return bridge;
}

inline CommandId NumberedId(std::uint32_t number) {
  CommandId id{};
  for (std::size_t i = 0; i < 4; ++i) id[i] = static_cast<std::uint8_t>(number >> (8 * i));
  return id;
}

inline driver_order_t OrderMessage(std::int64_t driver_boot_id, std::int64_t epoch, const CommandId& id,
                                   const std::string& device, const std::string& operation) {
  driver_order_t order{};
  order.driver_boot_id = driver_boot_id;
  order.bridge_boot_id = 77;
  order.bridge_epoch = epoch;
  std::copy(id.begin(), id.end(), std::begin(order.id));
  order.kind = driver_order_t::KIND_EXECUTE;
  order.valid_ms = 1'000;
  order.device = device;
  order.operation = operation;
  order.expect_epoch = -1;
  return order;
}

// Signed where there is a key.
inline std::vector<std::uint8_t> Enveloped(const driver_order_t& order, const SigningKey* key = nullptr) {
  driver_command_t envelope{};
  envelope.order = Encoded(order);
  envelope.order_size = static_cast<std::int16_t>(envelope.order.size());
  if (key != nullptr) {
    const Signature signature = key->Sign(Domain::kOrder, envelope.order);
    std::copy(signature.begin(), signature.end(), std::begin(envelope.sig));
  }
  return Encoded(envelope);
}

inline std::vector<std::uint8_t> Enveloped(const permit_body_t& body, const SigningKey* key = nullptr) {
  permit_t envelope{};
  envelope.permit = Encoded(body);
  envelope.permit_size = static_cast<std::int16_t>(envelope.permit.size());
  if (key != nullptr) {
    const Signature signature = key->Sign(Domain::kPermit, envelope.permit);
    std::copy(signature.begin(), signature.end(), std::begin(envelope.sig));
  }
  return Encoded(envelope);
}

}  // namespace axlecast
