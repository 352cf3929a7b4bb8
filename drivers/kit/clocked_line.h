#pragma once

#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"
#include "core/device/step.h"

namespace axlecast {

// Bit `index` of what was clocked in: the most significant bit of the first byte came first.
[[nodiscard]] constexpr bool BitAt(Bytes bytes, std::size_t index) {
  return (bytes[index / 8] >> (7 - index % 8) & 1) != 0;
}

// `count` bits from `first` on, at most 64, the first of them the most significant.
[[nodiscard]] constexpr std::uint64_t BitsAt(Bytes bytes, std::size_t first, std::size_t count) {
  assert(count <= 64 && first + count <= bytes.size() * 8);
  std::uint64_t value = 0;
  for (std::size_t at = first, left = count; left > 0;) {
    const std::size_t in_byte = 8 - at % 8;
    const std::size_t taken = in_byte < left ? in_byte : left;
    value = value << taken | (bytes[at / 8] >> (in_byte - taken) & ((1U << taken) - 1));
    at += taken;
    left -= taken;
  }
  return value;
}

// Returns the rule for a reply of this length. `bytes` is at most kMaxFrame.
[[nodiscard]] inline ReplyLength AsLongAs(std::size_t bytes) {
  constexpr auto kRules = []<std::size_t... N>(std::index_sequence<N...>) {
    return std::array<ReplyLength, sizeof...(N)>{&FixedLength<N>...};
  }
  (std::make_index_sequence<kMaxFrame + 1>());
  return kRules.at(bytes);
}

// Returns an exchange that clocks `bytes` in. On SPI, as many bytes are sent; the devices ignore them.
[[nodiscard]] inline Exchange ClockedExchange(std::size_t bytes, MonoNs timeout) {
  Exchange exchange;
  for (std::size_t i = 0; i < bytes; ++i) exchange.request.Append(std::uint8_t{0});
  exchange.reply_length = AsLongAs(bytes);
  exchange.timeout = timeout;
  return exchange;
}

// An RS-422 line: the host sends the clock over a cable, and the encoder's data return with it. The rules are those of the
// makers' SSI descriptions.
struct ClockedLine {
  double cable_m = 0;
  double cable_ns_per_m = 6.5;     // specific transit time of TWK's cable (TWK SSI 11.3)
  double encoder_delay_ns = 150;   // t_C: the encoder's electronics, at most (TWK SSI 11.3)
  double receiver_delay_ns = 150;  // t_E: the host's clock driver and data receiver, at most (TWK SSI 11.3)
  MonoNs monoflop = 0;             // minimum; 0: unknown
  double least_hz = 0;             // clock limits of the encoder itself; 0: unknown
  double most_hz = 0;
};

// The limits of the clock. A clock must be between two of them, and equal to neither.
struct ClockPlan {
  double delay_ns = 0;               // t_TD, from an edge of the clock to its effect on the data, both at the host
  double lowest_hz = 0;              // t_T < t_M (min): TWK SSI 10
  double highest_hz = 0;             // of the encoder and the cable: for reading that is delayed to fit
  double highest_half_cycle_hz = 0;  // for reading half a cycle after the edge that changed the data, as SPI does
  std::int64_t half_cycle_hz = 0;    // a clock for that; 0: no clock fits
};
[[nodiscard]] ClockPlan PlanClock(const ClockedLine& line);

// The time from the edge that requests a bit to its reading: t_TD < t_EV < t_TD + t_T (TWK SSI 11.4).
struct EvaluationDelay {
  double least_ns = 0;
  double best_ns = 0;
  double most_ns = 0;
};
[[nodiscard]] EvaluationDelay PlanEvaluation(const ClockPlan& plan, double clock_hz);

}  // namespace axlecast
