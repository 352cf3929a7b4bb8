#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/runtime/core/instant.h"
#include "drivers/tformat/encoder_model.h"
#include "drivers/tformat/simulator_fault.h"

namespace axlecast::tformat {

// When a reply reaches the host.
enum class Pace : std::uint8_t {
  kUnpaced,  // at once
  kWire,     // when its last bit would end on the wire
  kSlots,    // at the next multiple of the slot on CLOCK_MONOTONIC
};

// All that a file, a script or a person can set of a simulated encoder and its line.
struct SimulatedAxis {
  explicit SimulatedAxis(EncoderModel model) : encoder(std::move(model)) {}

  EncoderModel encoder;
  std::string motion = "constant";
  SimulatedFault fault;
  Pace pace = Pace::kWire;
  double slot_us = 51;         // spec: 4 us request, 3 us, 44 us reply of data ID 3
  bool abnormal_echo = false;  // an abnormal request is answered with its own control field, not with data ID 3's
};

// The names that SetQuantity takes, in the order in which a mapping of several is applied.
[[nodiscard]] const std::vector<std::string_view>& QuantityNames();

// Sets one quantity at axis.encoder.now(). Empty when done, else what would be right.
[[nodiscard]] std::string SetQuantity(SimulatedAxis& axis, std::string_view name, std::string_view value);

// Every quantity with its present value (at axis.encoder.now()), then what the encoder measures and what was done
// to it.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> Quantities(const SimulatedAxis& axis);

}  // namespace axlecast::tformat
