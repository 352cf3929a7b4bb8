#include "tests/campaign/tally.h"

#include <cmath>
#include <cstdio>

#include "core/messages/message.h"

namespace axlecast {

std::optional<position_t> Tally::Count(const std::string& channel, Bytes message) {
  if (channel != "POSITION/axis1") return std::nullopt;
  std::optional<position_t> position = DecodeMessage<position_t>(message);
  if (!position || (position->flags & position_t::FLAG_VALID) == 0) {
    ++withheld;
    return std::nullopt;
  }
  ++valid;
  return position;
}

bool Agrees(std::int64_t seen, double expected) {
  return std::abs(static_cast<double>(seen) - expected) <= 5 * std::sqrt(expected) + 0.05 * expected + 3;
}

void PrintWrong(const Tally& tally, double expected) {
  std::printf("  published valid and wrong: outside the bound %lld, inside it %lld (theory %.1f)\n",
              Long{tally.outside}, Long{tally.wrong - tally.outside}, expected);
}

void PrintErrors(const DevicePublisher& channel) {
  std::printf("  errors:");
  for (std::size_t kind = 0; kind < kErrorKinds; ++kind) {
    const std::int64_t count = channel.errors(static_cast<ErrorKind>(kind));
    if (count > 0) std::printf(" %s %lld", ErrorName(static_cast<ErrorKind>(kind)), Long{count});
  }
  std::printf("\n");
}

}  // namespace axlecast
