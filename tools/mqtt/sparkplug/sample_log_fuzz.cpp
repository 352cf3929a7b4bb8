#include <cstdlib>

#include "tools/mqtt/sparkplug/birth_sequence.h"
#include "tools/mqtt/sparkplug/message_metrics.h"
#include "tools/mqtt/sparkplug/sample_log.h"

// What the files of the state folder may hold after a fault of the disk. The log itself is read by LogReader, which has a
// target of its own.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (const auto mark = axlecast::ParseMark(text)) {
    if (axlecast::ParseMark(axlecast::FormatMark(*mark)) != mark) std::abort();
  }
  if (const auto number = axlecast::ParseBirthSequence(text)) {
    if (axlecast::ParseBirthSequence(axlecast::FormatBirthSequence(*number)) != number) std::abort();
  }
  for (const char* channel :
       {"POSITION/a", "MOTOR/a", "DEVICE/a", "ALARM/a", "TRIP/a", "COMMAND_STATUS/a", "BUS/a"}) {
    static_cast<void>(axlecast::MetricsOf(channel, {data, size}));
  }
  return 0;
}
