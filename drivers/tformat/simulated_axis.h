#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/time.h"
#include "drivers/kit/simulation/simulated_device.h"
#include "drivers/kit/simulation/simulated_fault.h"
#include "drivers/tformat/encoder_model.h"

namespace axlecast::tformat {

// When a reply reaches the host.
enum class Pace : std::uint8_t {
  kUnpaced,  // at once
  kWire,     // when its last bit would end on the wire
  kSlots,    // at the next multiple of the slot on CLOCK_MONOTONIC
};

// All that a file, a script or a person can set of a simulated encoder and its line.
struct SimulatedAxis final : SimulatedDevice {
  explicit SimulatedAxis(EncoderModel model) : encoder(std::move(model)) {}

  void Advance(MonoNs now) override { encoder.Advance(now); }
  [[nodiscard]] std::string Set(std::string_view name, std::string_view value) override;  // of QuantityNames()

  EncoderModel encoder;
  std::string motion = "constant";
  SimulatedFault fault;
  Pace pace = Pace::kWire;
  double slot_us = 51;         // spec: 4 us request, 3 us, 44 us reply of data ID 3
  bool abnormal_echo = false;  // an abnormal request is answered with its own control field, not with data ID 3's
};

// The names that SimulatedAxis::Set takes, in the order in which a mapping of several is applied.
[[nodiscard]] const std::vector<std::string_view>& QuantityNames();

// Every quantity with its present value (at axis.encoder.now()), then what the encoder measures and what was done
// to it.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> Quantities(const SimulatedAxis& axis);

}  // namespace axlecast::tformat
