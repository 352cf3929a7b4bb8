#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "tools/axlecast/device_data/device_access.h"

// Any file: the parser must not crash. It returns an error, or a backup whose file is parsed to the same backup.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace axlecast;
  const auto parsed = ParseDeviceBackup({reinterpret_cast<const char*>(data), size});
  DeviceBackup backup = parsed.value_or(DeviceBackup());
  if (!parsed) {
    // A random checksum is rarely right: use the bytes as text and memory of a device.
    backup.device.assign(reinterpret_cast<const char*>(data), size);
    backup.unix_us = 1;
    for (std::size_t i = 0; i < size; ++i) backup.cells[data[i] + 256 * (i % 7)] = data[i];
  }
  const std::string text = ToFileText(backup);
  const auto read = ParseDeviceBackup(text);
  if (!read || read->cells != backup.cells || ToFileText(*read) != text) std::abort();
  return 0;
}
