#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "core/device/step.h"

namespace axlecast {

// A reply as long as this, whatever it says. `bytes` is at most kMaxFrame.
[[nodiscard]] inline ReplyLength AsLongAs(std::size_t bytes) {
  constexpr auto kRules = []<std::size_t... N>(std::index_sequence<N...>) {
    return std::array<ReplyLength, sizeof...(N)>{&FixedLength<N>...};
  }
  (std::make_index_sequence<kMaxFrame + 1>());
  return kRules.at(bytes);
}

// Clocks so many bytes in: on SPI the reply is as long as what goes out, which no device looks at here.
[[nodiscard]] inline Exchange ClockedExchange(std::size_t bytes, MonoNs timeout) {
  Exchange exchange;
  for (std::size_t i = 0; i < bytes; ++i) exchange.request.Append(std::uint8_t{0});
  exchange.reply_length = AsLongAs(bytes);
  exchange.timeout = timeout;
  return exchange;
}

}  // namespace axlecast
