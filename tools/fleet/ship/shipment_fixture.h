#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"
#include "tools/fleet/row_fixture.h"
#include "tools/fleet/ship/log_shipment.h"

namespace axlecast {

// For tests: a log of one axis in a folder, which grows stretch by stretch.
class ShipmentFixture : public ::testing::Test {
 protected:
  ShipmentFixture() {
    log_.file = "a.lcm";
    log_.key = {"all", "plc1", kT0, 0};
    log_.facts = std::make_shared<const LogFacts>(PressFacts());
    Append({.utime = kT0, .channel = kRecorderChannel, .data = {}});
  }

  void Append(const LogEvent& event) {
    const Bytes record = encoder_.Add(event);
    offsets_.push_back(bytes_.size());
    bytes_.insert(bytes_.end(), record.begin(), record.end());
  }
  // Appends `count` positions, 4 ms apart, and their seal.
  void AppendStretch(int count) {
    for (int i = 0; i < count; ++i) {
      position_t position{};
      position.utime = kT0 + 4'000 * seq_;
      position.boot_id = kBoot;
      position.seq = seq_++;
      position.counts = 100 + position.seq;
      position.counts_per_turn = 131'072;
      position.unit = position_t::UNIT_MM;
      position.flags = position_t::FLAG_VALID;
      const std::vector<std::uint8_t> message = Encoded(position);
      Append({.utime = position.utime + 500, .channel = "POSITION/axis1", .data = message});
    }
    const Bytes seal = encoder_.Seal(kT0 + 4'000 * seq_);
    bytes_.insert(bytes_.end(), seal.begin(), seal.end());
  }
  // Replaces the file: one that is mapped must not become shorter.
  void Write() {
    const std::string file = folder_.path() + "/a.lcm";
    std::ofstream(file + ".new", std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes_.data()), static_cast<std::streamsize>(bytes_.size()));
    std::filesystem::rename(file + ".new", file);
    log_.bytes = static_cast<std::int64_t>(bytes_.size());
  }
  std::unique_ptr<LogShipment> Open(const LedgerEntry& entry = {.id = 7}) {
    Write();
    return LogShipment::Open(folder_.path(), log_, entry, {}, kThisYear, std::nullopt).value();
  }

  TemporaryFolder folder_;
  FolderLog log_;
  LogEncoder encoder_;
  std::vector<std::uint8_t> bytes_;
  std::vector<std::size_t> offsets_;
  std::int64_t seq_ = 0;
};

}  // namespace axlecast
