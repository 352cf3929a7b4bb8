#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "tools/axlecast/device_data/device_backup.h"

// Whatever the file holds: it is refused, or what was read gives a file that reads the same.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace axlecast;
  std::string problem;
  DeviceBackup backup = ParseDeviceBackup({reinterpret_cast<const char*>(data), size}, problem);
  if (!problem.empty()) {
    // A guessed sum is rare: the rest is tried with what the bytes would be as a device's text.
    backup = {};
    backup.device.assign(reinterpret_cast<const char*>(data), size);
    backup.utime = 1;
    for (std::size_t i = 0; i < size; ++i) backup.cells[data[i] + 256 * (i % 7)] = data[i];
  }
  const std::string text = ToFileText(backup);
  std::string again;
  const DeviceBackup read = ParseDeviceBackup(text, again);
  if (!again.empty() || read.cells != backup.cells || ToFileText(read) != text) std::abort();
  return 0;
}
