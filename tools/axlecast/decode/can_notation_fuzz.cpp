// Any text: the parser must not crash, and what it takes is a frame.
#include <cstdlib>
#include <string>

#include "core/device/can.h"
#include "tools/axlecast/decode/can_notation.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(data, data + size);
  const auto line = axlecast::ParseCanNotation(text);
  if (!line) return 0;
  if (line->problem.empty() != axlecast::FromPacket(line->bytes).has_value()) std::abort();
  return 0;
}
