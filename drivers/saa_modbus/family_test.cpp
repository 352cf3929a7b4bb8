// What the family declares to the rest of the product, where the manual defines it.
#include "core/device/family.h"

#include <gtest/gtest.h>

#include "drivers/saa_modbus/operations.h"

namespace axlecast {

const Family& saa_modbus_family();

namespace {

// 5.1.7 (3): 19,200 Bd, no parity; 5: 8 data bits, 1 stop bit.
TEST(SaaModbusFamily, DefaultsAreTheManuals) {
  const Family& family = saa_modbus_family();
  EXPECT_EQ(family.default_line.baud, 19'200);
  EXPECT_EQ(family.default_line.parity, Parity::kNone);
  EXPECT_EQ(family.default_line.BitsPerCharacter(), 10);
  EXPECT_EQ(family.link, LinkKind::kModbus);
  EXPECT_EQ(family.max_devices_per_bus, 32U);
  EXPECT_TRUE(family.has_position);
}

TEST(SaaModbusFamily, WhatWritesIsAskedForFirstAndCanBeLookedInto) {
  for (const OperationSpec& operation : saa_modbus_family().operations) {
    const bool writes = saa_modbus::Writes(operation.name);
    EXPECT_EQ(operation.destructive, writes) << operation.name;
    EXPECT_EQ(operation.needs_permit, writes) << operation.name;
    EXPECT_EQ(operation.verified_by_operation, writes ? "read_position" : "") << operation.name;
    EXPECT_FALSE(operation.verification.empty()) << operation.name;
    EXPECT_EQ(operation.needs_standstill, operation.name == "zero" || operation.name == "set_direction");
  }
}

}  // namespace
}  // namespace axlecast
