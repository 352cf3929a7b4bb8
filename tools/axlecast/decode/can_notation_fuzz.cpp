// Any text: the parser must not crash. What it accepts is a frame.
#include <cstdlib>
#include <string>

#include "core/device/can.h"
#include "tools/axlecast/decode/frame_text.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(data, data + size);
  const auto line = axlecast::ParseCanNotation(text);
  if (!line) return 0;
  if (*line && !axlecast::FromPacket(**line)) std::abort();
  return 0;
}
