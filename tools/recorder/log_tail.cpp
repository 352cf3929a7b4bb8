#include "tools/recorder/log_tail.h"

#include <algorithm>

#include "tools/log/log_reader.h"

namespace axlecast {

LogTail FindTail(Bytes log) {
  LogTail tail;
  LogReader reader(log);
  while (const auto event = reader.Next()) {
    tail.begin.events = std::max(tail.begin.events, event->number + 1);
    tail.begin.bytes = reader.position();
    LogSeal& unsealed = tail.begin.unsealed;
    if (event->channel == kSealChannel) {
      unsealed = {};
      continue;
    }
    const Bytes record = log.subspan(reader.offset(), reader.position() - reader.offset());
    unsealed.bytes += record.size();
    ++unsealed.events;
    unsealed.crc32c = Crc32c(unsealed.crc32c, record);
  }
  for (const LogReader::Damage& damage : reader.damage()) {
    (damage.offset >= tail.begin.bytes ? tail.torn : tail.damaged) += damage.size;
  }
  return tail;
}

}  // namespace axlecast
