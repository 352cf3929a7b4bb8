#pragma once

#include <algorithm>
#include <axlecast/command_body_t.hpp>
#include <axlecast/command_t.hpp>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/command/keys.h"
#include "core/config/machine_config.h"
#include "core/messages/message.h"
#include "tests/support/counting_family.h"

namespace axlecast {

// For tests: a key of each role, and commands signed with it. `plc` is for `mark` and `zero` of axis1 only.
class AccessKeys {
 public:
  AccessKeys() {
    config.bridge.public_key = bridge.public_key();
    config.drivers.public_key = drivers.public_key();
    Add("viewer", Role::kObserver);
    Add("shift", Role::kOperator);
    Add("plc", Role::kControl);
    config.keys.back().devices = {"axis1"};
    config.keys.back().operations = {"mark", "zero"};
    Add("service", Role::kMaintainer);
  }

  void Add(const std::string& name, Role role) {
    SigningKey key = SigningKey::Generate();
    config.keys.push_back({.name = name,
                           .key = key.public_key(),
                           .id = KeyId(key.public_key()),
                           .role = role,
                           .devices = {},
                           .operations = {},
                           .place = {}});
    secrets_.emplace(name, std::move(key));
  }

  [[nodiscard]] const SigningKey& Secret(const std::string& name) const { return secrets_.at(name); }

  // `zero` of axis1, of the key.
  [[nodiscard]] command_t Signed(const std::string& name) const {
    command_body_t body{};
    body.bridge_boot_id = 42;
    body.issued_mono_ns = 1'000;
    body.valid_ms = 5'000;
    body.device = "axis1";
    body.operation = "zero";
    body.arguments = {{"note", "of " + name}};
    body.n_arguments = 1;
    body.key_id = KeyId(Secret(name).public_key());
    return Signed(Secret(name), body);
  }
  static command_t Signed(const SigningKey& key, const command_body_t& body) {
    command_t envelope{};
    SetBody(envelope, body);
    const Signature signature = key.Sign(Domain::kCommand, envelope.body);
    std::copy(signature.begin(), signature.end(), std::begin(envelope.sig));
    return envelope;
  }
  static void SetBody(command_t& envelope, const command_body_t& body) {
    envelope.body = Encoded(body);
    envelope.body_size = static_cast<std::int16_t>(envelope.body.size());
  }
  static command_body_t BodyOf(const command_t& envelope) {
    return DecodeMessage<command_body_t>(envelope.body).value_or(command_body_t{});
  }

  const SigningKey bridge = SigningKey::Generate();
  const SigningKey drivers = SigningKey::Generate();
  BridgeConfig config;

 private:
  std::map<std::string, SigningKey> secrets_;
};

}  // namespace axlecast
