// Any bytes as a seal: one that is read is written back equal; and the CRC of any bytes is that of its two parts.
#include <algorithm>
#include <cstdlib>

#include "tools/log/log_event.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const axlecast::Bytes bytes(data, size);
  if (const auto seal = axlecast::ParseSeal(bytes)) {
    if (!std::ranges::equal(axlecast::EncodeSeal(*seal), bytes)) std::abort();
  }
  const std::size_t cut = size == 0 ? 0 : data[0] % size;
  const std::uint32_t parts = axlecast::Crc32c(axlecast::Crc32c(0, bytes.first(cut)), bytes.subspan(cut));
  if (parts != axlecast::Crc32c(0, bytes)) std::abort();
  return 0;
}
