#include <cstdlib>

#include "tools/mqtt/link_frames.h"

// Whatever a damaged link process writes is refused, or reads back as the same event or command.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  axlecast::FrameBuffer buffer(1 << 16);
  buffer.Add({reinterpret_cast<const char*>(data), size});
  while (const auto body = buffer.Next()) {
    if (const auto event = axlecast::DecodeEvent(*body)) {
      const std::string again = axlecast::EncodeEvent(*event);
      if (!axlecast::DecodeEvent(std::string_view(again).substr(4))) std::abort();
    }
    if (const auto command = axlecast::DecodeCommand(*body)) {
      const std::string again = axlecast::EncodeCommand(*command);
      if (!axlecast::DecodeCommand(std::string_view(again).substr(4))) std::abort();
    }
  }
  return 0;
}
