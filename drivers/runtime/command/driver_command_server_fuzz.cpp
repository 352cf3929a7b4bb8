#include <axlecast/driver_command_t.hpp>
#include <axlecast/driver_order_t.hpp>

#include "drivers/runtime/command/driver_command_server.h"
#include "tests/support/counting_family.h"

// Arbitrary bytes as the messages of the bridge and of the control process: as they are, and inside good envelopes.
namespace axlecast {
namespace {

struct FuzzClock final : Clock {
  [[nodiscard]] MonoNs Now() const override { return now; }
  [[nodiscard]] std::int64_t UtcMicroseconds() const override { return now / kMicrosecond; }
  MonoNs now = kSecond;
};

// Every status must fit its message, whatever was asked.
struct FuzzSink final : MessageSink {
  void Publish(const std::string&, Bytes message) override {
    if (message.empty() || message.size() > kMaxMessage) __builtin_trap();
  }
};

// Where the bridge has a key, nothing that it did not sign is answered or done.
void RunSigned(Bytes data, const std::vector<std::uint8_t>& enveloped) {
  FuzzClock clock;
  struct : MessageSink {
    void Publish(const std::string&, Bytes) override { __builtin_trap(); }
  } silence;
  const BusConfig bus = CountingBus("b0", {"axis1"});
  static const SigningKey key = SigningKey::Generate();
  BridgeConfig bridge;
  bridge.bridge.public_key = key.public_key();
  DriverCommandServer server(bus, bridge, {{.boot_id = 5}, &clock, &silence, [] {}});
  server.OnDriverCommand(data);
  server.OnDriverCommand(enveloped);
  if (server.Take() || server.TakePrepare()) __builtin_trap();
}

void Run(Bytes data) {
  FuzzClock clock;
  FuzzSink sink;
  const BusConfig bus = CountingBus("b0", {"axis1", "axis2"});
  DriverCommandServer server(bus, UnsignedBridge(), {{.boot_id = 5}, &clock, &sink, [] {}});
  server.OnDriverCommand(data);
  server.OnPermit("axis1", data);

  driver_command_t envelope{};
  envelope.order.assign(data.begin(), data.end());
  envelope.order_size = static_cast<std::int16_t>(std::min<std::size_t>(data.size(), 1'200));
  envelope.order.resize(static_cast<std::size_t>(envelope.order_size));
  server.OnDriverCommand(Encoded(envelope));
  RunSigned(data, Encoded(envelope));

  driver_order_t order = OrderMessage(5, 9, NumberedId(data.empty() ? 0 : data[0]), "axis1", "bump");
  const std::string text(data.begin(), data.end());
  if (data.size() > 2) {
    order.kind = static_cast<std::int8_t>(data[1] % 5);
    if (data[2] % 4 == 0) order.device = text;
    if (data[2] % 4 == 1) order.operation = text;
    if (data[2] % 4 == 2) order.arguments = {{text, text}};
    order.n_arguments = static_cast<std::int8_t>(order.arguments.size());
  }
  if (order.getEncodedSize() <= 32'000) server.OnDriverCommand(Enveloped(order));
  if (const auto taken = server.Take()) {
    server.Report(taken->device, taken->command.id,
                  {.state = CommandState::kFailed, .text = text, .changes = {{text, text, text}}}, 1);
  }
  if (const auto asked = server.TakePrepare()) {
    server.ReportPrepared(asked->command.id, {.state = CommandState::kSucceeded, .text = text}, 1);
  }
  clock.now += 10 * kSecond;
  (void)server.TakeCancel();
  server.Goodbye();
}

}  // namespace
}  // namespace axlecast

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  axlecast::Run({data, size});
  return 0;
}
