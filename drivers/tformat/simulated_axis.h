#pragma once

#include <cstdint>
#include <utility>

#include "core/base/time.h"
#include "drivers/kit/simulation/simulated_fault.h"
#include "drivers/kit/simulation/unit_simulator.h"
#include "drivers/tformat/encoder_model.h"

namespace axlecast::tformat {

// When a reply reaches the host.
enum class Pace : std::uint8_t {
  kUnpaced,  // at once
  kWire,     // when its last bit would end on the wire
  kSlots,    // at the next multiple of the slot on CLOCK_MONOTONIC
};

// A simulated encoder and its line, with all that a file, a script or an operator can set.
struct SimulatedAxis final : TableDevice<SimulatedAxis> {
  explicit SimulatedAxis(EncoderModel model) : encoder(std::move(model)) {}

  void Advance(MonoNs now) override { encoder.Advance(now); }
  [[nodiscard]] static const QuantityTable<SimulatedAxis>& Table();
  // Every quantity with its present value, then what the encoder measures and what was done to it.
  [[nodiscard]] QuantityList Quantities() const;

  EncoderModel encoder;
  SimulatedFault fault;
  Pace pace = Pace::kWire;
  double slot_us = 51;         // spec: 4 us request, 3 us, 44 us reply of data ID 3
  bool abnormal_echo = false;  // an abnormal request is answered with its own control field, not with data ID 3's
};

}  // namespace axlecast::tformat
