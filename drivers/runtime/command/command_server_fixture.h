#pragma once

#include <gtest/gtest.h>

#include <axlecast/driver_order_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <cstdint>
#include <string>

#include "core/command/commands.h"
#include "drivers/runtime/command/driver_command_server.h"
#include "tests/support/counting_family.h"
#include "tests/support/fake_clock.h"
#include "tests/support/memory_sink.h"

namespace axlecast {

// The server of a bus of two devices, which takes orders of `kind` unless a test sends another one.
class CommandServerTest : public testing::Test {
 protected:
  static constexpr std::int64_t kBoot = 5;

  explicit CommandServerTest(std::int8_t kind) : kind_(kind) {}

  driver_status_t Send(std::uint32_t number) { return Send(number, kind_); }
  driver_status_t Send(std::uint32_t number, std::int8_t kind, const std::string& operation = "bump") {
    driver_order_t order = OrderMessage(kBoot, ++epoch_, NumberedId(number), "axis1", operation);
    order.kind = kind;
    server_.OnDriverCommand(Enveloped(order));
    return Last();
  }
  [[nodiscard]] driver_status_t Last() const { return sink_.All<driver_status_t>("DRIVER_STATUS/b0").back(); }

  const std::int8_t kind_;
  FakeClock clock_;
  MemorySink sink_;
  int woken_ = 0;
  std::int64_t epoch_ = 0;
  BusConfig bus_ = CountingBus("b0", {"axis1", "axis2"});
  DriverCommandServer server_{bus_, UnsignedBridge(), {{.boot_id = kBoot}, &clock_, &sink_, [this] { ++woken_; }}};
};

}  // namespace axlecast
