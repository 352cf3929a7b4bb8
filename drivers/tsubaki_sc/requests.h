#pragma once

#include <cstdint>
#include <span>

#include "core/device/step.h"
#include "drivers/tsubaki_sc/register_map.h"

namespace axlecast::tsubaki_sc {

// The exchanges with one unit.
class Requests {
 public:
  Requests(std::uint8_t address, MonoNs timeout) : address_(address), timeout_(timeout) {}

  [[nodiscard]] std::uint8_t address() const { return address_; }
  [[nodiscard]] Exchange Read(const Block& block) const;
  [[nodiscard]] Exchange SetCoil(std::uint16_t coil) const;  // to ON; nothing here ever writes OFF
  // One value by function 06, several by function 16.
  [[nodiscard]] Exchange Write(std::uint16_t first, std::span<const std::uint16_t> values) const;
  // A request that holds a password, or is answered with one.
  [[nodiscard]] Exchange Secret(const Frame& request) const;

 private:
  [[nodiscard]] Exchange Ask(const Frame& request) const;

  std::uint8_t address_;
  MonoNs timeout_;
};

// The request is a login: a write to AO 100-107.
[[nodiscard]] bool IsLogin(Bytes request);

}  // namespace axlecast::tsubaki_sc
