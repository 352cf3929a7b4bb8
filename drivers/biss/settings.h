#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "core/config/machine_config.h"
#include "drivers/biss/codec.h"

namespace axlecast::biss {

// The family's keys of a bus: README.md, "Configuration".
struct BissBus final : FamilyBus {
  MonoNs timeout = 0;     // of the encoder, between two frames
  MonoNs line_delay = 0;  // longest way from the clock's edge at the controller to the answer there
  int spi_mode = 2;
};

// The family's keys of one device.
struct BissSettings final : DeviceSettings {
  Format format;
  Search search;
  std::size_t transfer_bytes = 0;  // clocks / 8
  std::size_t start_jitter = 1;    // clocks by which the start bit may move from one frame to the next
};

// A frame ends when the clock rests for this time (5.6: "Timeout"). The manual gives no tolerance: the pause between two
// transfers is a quarter longer.
inline constexpr std::int64_t kTimeoutUs = 16;
// 5.6: "TMAS: Minimum allowable clock cycle > 100 ns". The limit itself is not allowed, as in the maker's note on SSI
// (5.5: "T_cs > 4 us; 100 kHz < f_clk < 250 kHz").
inline constexpr std::int64_t kTooFastHz = 10'000'000;
// What spidev controllers have and RS-422 drivers carry far; a reading of 16 bits then takes some 50 us.
inline constexpr std::int64_t kDefaultClockHz = 1'000'000;
// "Tbusy: Minimum data output delay = 2 x TMAS".
inline constexpr std::int64_t kMinBusyClocks = 2;

// For Family. Errors go into the map's list; never null.
[[nodiscard]] std::shared_ptr<const FamilyBus> ParseBus(ConfigMap& map, const BusConfig& bus);
[[nodiscard]] std::unique_ptr<DeviceSettings> ParseDevice(ConfigMap& device, const BusConfig& bus);

[[nodiscard]] const BissBus& OwnBus(const BusConfig& bus);
[[nodiscard]] const BissSettings& Own(const DeviceConfig& device);

// Where acknowledgement and start bit are looked for, and how long a transfer has to be, at a clock.
struct Reach {
  Search search;
  std::size_t bytes = 0;
};
[[nodiscard]] Reach ReachOf(const SpiSettings& spi, MonoNs line_delay, MonoNs busy, const Format& format);

// Returns the polynomial given with its highest term (x^6 + x + 1 = 0x43) or without it (0x03); 0 if it is not one
// of that many bits: without the term 1 it would not see every single wrong bit.
[[nodiscard]] std::uint32_t Polynomial(std::int64_t given, int bits);

}  // namespace axlecast::biss
