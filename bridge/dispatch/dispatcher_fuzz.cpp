#include <axlecast/device_info_t.hpp>
#include <axlecast/driver_command_t.hpp>
#include <axlecast/driver_order_t.hpp>

#include "bridge/dispatch/dispatcher.h"
#include "bridge/store/memory_store_fixture.h"
#include "core/messages/message.h"
#include "tests/support/counting_family.h"

// Arbitrary bytes as the messages of clients, drivers and other bridges: as they are, and as bodies of good
// envelopes.
namespace axlecast {
namespace {

struct FuzzSink final : MessageSink {
  void Publish(const std::string& channel, Bytes message) override {
    if (message.empty() || message.size() > kMaxMessage) __builtin_trap();
    if (!channel.starts_with("DRIVER_COMMAND/")) return;
    const auto envelope = DecodeMessage<driver_command_t>(message);
    if (!envelope || !DecodeMessage<driver_order_t>(envelope->order)) __builtin_trap();
  }
};

class Fuzz {
 public:
  void Run(Bytes data) {
    Hello();
    bridge_.OnCommand(data, now_);
    bridge_.OnDriverStatus("DRIVER_STATUS/b0", data, now_);
    bridge_.OnCommandStatus(data, now_);
    Command({data.begin(), data.end()});
    Field(data);
    for (int i = 0; i < 10; ++i) {
      now_.mono += kSecond;
      bridge_.Tick(now_);
    }
    Hello();
    bridge_.Tick(now_);
  }

 private:
  void Hello() {
    driver_status_t hello{};
    hello.boot_id = 7;
    hello.bus = "b0";
    driver_device_t device{};
    device.device = "axis1";
    device.state = device_info_t::STATE_ONLINE;
    hello.devices = {device};
    hello.n_devices = 1;
    bridge_.OnDriverStatus("DRIVER_STATUS/b0", Encoded(hello), now_);
  }
  void Command(std::vector<std::uint8_t> body) {
    command_t envelope{};
    envelope.body = std::move(body);
    if (envelope.body.size() > 1'200) return;
    envelope.body_size = static_cast<std::int16_t>(envelope.body.size());
    bridge_.OnCommand(Encoded(envelope), now_);
  }
  // A good command and the driver's answer to it, of which one field is arbitrary.
  void Field(Bytes data) {
    if (data.size() < 2 || data.size() > 1'000) return;
    const std::string text(data.begin() + 2, data.end());
    command_body_t body{};
    body.bridge_boot_id = 42;
    body.issued_mono_ns = now_.mono;
    body.valid_ms = 1'000;
    body.device = data[0] % 4 == 0 ? text : "axis1";
    body.operation = data[0] % 4 == 1 ? text : "write";
    body.arguments = {{"address", "1"}, {"bytes", data[0] % 4 == 2 ? text : "A1"}};
    body.n_arguments = 2;
    body.mode = static_cast<std::int8_t>(data[1] % 6);
    Command(Encoded(body));
    driver_status_t status{};
    status.boot_id = 7;
    status.seq = 1;
    status.kind = driver_status_t::KIND_STATUS;
    status.bus = "b0";
    status.state = static_cast<std::int8_t>(data[1]);
    status.text = text;
    status.changes = {{text, text, text}};
    status.n_changes = 1;
    status.bridge_epoch = INT64_MAX;
    bridge_.OnDriverStatus("DRIVER_STATUS/b0", Encoded(status), now_);
  }

  static MachineConfig Machine() {
    MachineConfig machine;
    machine.bridge.allow_unsigned = true;
    machine.buses = {CountingBus("b0", {"axis1", "axis2"})};
    return machine;
  }

  Timestamp now_{1'000 * kSecond, 0};
  MachineConfig machine_ = Machine();
  MemoryStore store_;
  FuzzSink sink_;
  InlineJournal journal_{store_};
  Dispatcher bridge_{machine_,
                     Origin{.boot_id = 42},
                     {.journal = &journal_,
                      .commands = &sink_,
                      .data = &sink_,
                      .log = [](const std::string&) {},
                      .random = [] { return NumberedId(7); }},
                     {0, 0}};
};

}  // namespace
}  // namespace axlecast

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  axlecast::Fuzz().Run({data, size});
  return 0;
}
