#pragma once

#include <array>

#include "drivers/saa_modbus/procedure.h"

namespace axlecast::saa_modbus {

// Looks at which of two places, a baud rate and an address each, the encoder answers: first `first`, then `second`.
class Search {
 public:
  struct Place {
    std::uint8_t address = 0;
    std::int64_t baud = 0;
  };
  enum class Progress : std::uint8_t { kGoing, kFirst, kSecond, kNowhere };

  // How long the encoder may take to listen at its new place is not documented.
  static constexpr MonoNs kSettle = 50 * kMillisecond;

  Search(Place first, Place second, const Connection& connection)
      : places_{first, second}, connection_(connection) {}

  // Not before `from`.
  void Start(MonoNs from) { due_ = from; }
  [[nodiscard]] Want Next(MonoNs now) const;
  void OnRetuned(MonoNs now) { due_ = now + kSettle; }
  [[nodiscard]] Progress OnAnswer(const Answer& answer);
  [[nodiscard]] std::uint32_t counts() const { return counts_; }  // when it was found

 private:
  [[nodiscard]] const Place& place() const { return places_.at(tried_); }

  std::array<Place, 2> places_;
  const Connection& connection_;
  std::size_t tried_ = 0;
  int failures_ = 0;
  MonoNs due_ = 0;
  std::uint32_t counts_ = 0;
};

}  // namespace axlecast::saa_modbus
