#pragma once

#include <gtest/gtest.h>

#include <axlecast/device_info_t.hpp>
#include <axlecast/driver_command_t.hpp>
#include <axlecast/driver_order_t.hpp>
#include <string>
#include <utility>
#include <vector>

#include "bridge/dispatch/dispatcher.h"
#include "bridge/store/memory_store_fixture.h"
#include "core/command/commands.h"
#include "core/messages/enum_names.h"
#include "core/messages/message.h"
#include "tests/support/counting_family.h"
#include "tests/support/memory_sink.h"

namespace axlecast {

using S = command_status_t;

inline constexpr std::int64_t kBoot = 42;
inline constexpr std::int64_t kDriver = 7;

inline MachineConfig TestMachine(bool allow_unsigned) {
  MachineConfig machine;
  machine.machine = "press3";
  machine.bridge.allow_unsigned = allow_unsigned;
  machine.buses = {CountingBus("b0", {"axis1", "axis2"})};
  return machine;
}

inline driver_device_t OnlineDevice(const std::string& name) {
  driver_device_t device{};
  device.device = name;
  device.state = device_info_t::STATE_ONLINE;
  return device;
}

// A bridge with one bus of two devices, of which the test is the client and the driver.
class DispatcherTest : public testing::Test {
 protected:
  explicit DispatcherTest(bool allow_unsigned = true) : DispatcherTest(TestMachine(allow_unsigned), {}) {}
  DispatcherTest(MachineConfig machine, std::optional<SigningKey> key)
      : machine_(std::move(machine)), key_(std::move(key)), bridge_(MakeBridge(kBoot)) {
    Pass(DuplicateBridgeDetector::kListen);
    Hello(kDriver);
    sink_.Clear();
  }

  void Pass(MonoNs time) {
    for (const MonoNs end = now_.mono + time; now_.mono < end; Step(10 * kMillisecond)) {
    }
  }
  void Step(MonoNs time) {
    now_.mono += time;
    now_.utime += time / kMicrosecond;
    bridge_->Tick(now_);
  }
  // A second in which the driver sends HELLO every 100 ms.
  void PassWithDriver(MonoNs time) {
    for (const MonoNs end = now_.mono + time; now_.mono < end; Pass(100 * kMillisecond)) Hello(driver_boot_);
  }

  command_body_t Body(std::uint32_t number, const std::string& operation = "bump") {
    command_body_t body{};
    const CommandId id = NumberedId(number);
    std::copy(id.begin(), id.end(), std::begin(body.id));
    body.bridge_boot_id = kBoot;
    body.issued_mono_ns = now_.mono;
    body.valid_ms = 1'000;
    body.device = "axis1";
    body.operation = operation;
    body.expect_epoch = -1;
    return body;
  }
  S Send(const command_body_t& body) {
    bridge_->OnCommand(Encoded(EnvelopeOf(body)), now_);
    return Last();
  }
  static command_t EnvelopeOf(const command_body_t& body) {
    command_t envelope{};
    envelope.body = Encoded(body);
    envelope.body_size = static_cast<std::int16_t>(envelope.body.size());
    return envelope;
  }
  S SendSigned(command_body_t body, const SigningKey& key) {
    body.key_id = KeyId(key.public_key());
    command_t envelope = EnvelopeOf(body);
    const Signature signature = key.Sign(Domain::kCommand, envelope.body);
    std::copy(signature.begin(), signature.end(), std::begin(envelope.sig));
    bridge_->OnCommand(Encoded(envelope), now_);
    return Last();
  }
  S SendAs(command_body_t body, std::int8_t mode) {
    body.mode = mode;
    return Send(body);
  }
  S Last() const {
    const auto all = sink_.All<S>("COMMAND_STATUS");
    return all.empty() ? S{} : all.back();
  }
  std::size_t Statuses() const { return sink_.All<S>("COMMAND_STATUS").size(); }

  std::vector<driver_order_t> Orders() const {
    std::vector<driver_order_t> orders;
    for (const auto& envelope : sink_.All<driver_command_t>("DRIVER_COMMAND/b0")) {
      orders.push_back(DecodeMessage<driver_order_t>(envelope.order).value_or(driver_order_t{}));
    }
    return orders;
  }
  void Hello(std::int64_t boot_id, bool lost = false, std::int8_t kind = driver_status_t::KIND_HELLO) {
    driver_boot_ = boot_id;
    driver_status_t hello{};
    hello.kind = kind;
    if (kind == driver_status_t::KIND_HELLO) {
      hello.devices = {OnlineDevice("axis1"), OnlineDevice("axis2")};
      hello.devices[0].reference_lost = lost ? 1 : 0;
      hello.n_devices = 2;
    }
    FromDriver(hello);
  }
  void HelloWith(std::int64_t boot_id, const driver_device_t& axis1) {
    driver_boot_ = boot_id;
    driver_status_t hello{};
    hello.kind = driver_status_t::KIND_HELLO;
    hello.devices = {axis1};
    hello.n_devices = 1;
    FromDriver(hello);
  }
  void Report(const driver_order_t& order, std::int8_t state, std::vector<change_t> changes = {},
              std::int32_t nv_writes = 0, bool verified = true) {
    driver_status_t status{};
    status.kind = driver_status_t::KIND_STATUS;
    std::copy(std::begin(order.id), std::end(order.id), std::begin(status.id));
    status.device = order.device;
    status.operation = order.operation;
    status.state = state;
    status.verified = state == S::STATE_SUCCEEDED && verified ? 1 : 0;
    status.bridge_epoch = order.bridge_epoch;
    status.nv_writes = nv_writes;
    if (IsFinalState(state)) status.finished_utime = now_.utime;
    status.epoch_after = 3;
    status.changes = std::move(changes);
    status.n_changes = static_cast<std::int8_t>(status.changes.size());
    FromDriver(status);
  }
  void ReportFailure(const driver_order_t& order, std::int32_t reason) {
    driver_status_t status{};
    status.kind = driver_status_t::KIND_STATUS;
    std::copy(std::begin(order.id), std::end(order.id), std::begin(status.id));
    status.device = order.device;
    status.operation = order.operation;
    status.state = S::STATE_FAILED;
    status.reason_code = reason;
    status.bridge_epoch = order.bridge_epoch;
    FromDriver(status);
  }
  void FromDriver(driver_status_t status) {
    status.bus = "b0";
    status.boot_id = driver_boot_;
    status.seq = driver_seq_++;
    bridge_->OnDriverStatus("DRIVER_STATUS/b0", Encoded(status), now_);
  }

  Timestamp now_{1'000 * kSecond, 1'700'000'000'000'000};
  MachineConfig machine_;
  // As after kill -9: what the store holds is all that is left.
  void RestartBridge(std::int64_t boot_id) {
    bridge_.reset();
    bridge_ = MakeBridge(boot_id);
    sink_.Clear();
    Pass(DuplicateBridgeDetector::kListen);
  }
  std::unique_ptr<Dispatcher> MakeBridge(std::int64_t boot_id, bool stalled = false) {
    journal_ = std::make_unique<InlineJournal>(store_);
    if (stalled) journal_->Stall();
    return std::make_unique<Dispatcher>(
        machine_, Origin{.boot_id = boot_id},
        BridgePorts{.journal = journal_.get(),
                    .commands = &sink_,
                    .data = &data_,
                    .key = key_ ? &*key_ : nullptr,
                    .other_machines = [this] { return other_machines_; },
                    .log = [this](const std::string& line) { logged_.push_back(line); },
                    .random = [this] { return NumberedId(1'000'000 + ++prepared_); }},
        now_);
  }

  std::vector<OtherMachine> other_machines_;
  std::vector<std::string> logged_;
  std::optional<SigningKey> key_;
  std::uint32_t prepared_ = 0;
  MemoryStore store_;
  MemorySink sink_;
  MemorySink data_;
  std::unique_ptr<InlineJournal> journal_;
  std::unique_ptr<Dispatcher> bridge_;
  std::int64_t driver_boot_ = kDriver;
  std::int64_t driver_seq_ = 0;
};

}  // namespace axlecast
