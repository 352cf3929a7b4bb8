#include "tools/log/log_tail.h"

#include "tools/log/log_reader.h"

namespace axlecast {
namespace {

// Whether the end could be judged from `begin` on: a seal stands there, or nothing is before.
bool ReadTail(Bytes log, std::size_t begin, LogTail& tail) {
  bool sealed = begin == 0;
  LogReader reader(log, begin);
  for (auto event = reader.Next(); event; event = reader.Next()) {
    tail.size = reader.position();
    tail.next_number = event->number < 0 || event->number == INT64_MAX ? 0 : event->number + 1;
    if (event->channel == kSealChannel) {
      tail.open.Reset();
      sealed = true;
    } else {
      tail.open.Add(log.subspan(reader.offset(), EventSize(*event)));
    }
  }
  tail.torn = log.size() - tail.size;
  return sealed;
}

}  // namespace

LogTail FindTail(Bytes log, std::size_t look) {
  LogTail tail;
  if (log.size() > look && ReadTail(log, log.size() - look, tail)) return tail;
  tail = {};
  static_cast<void>(ReadTail(log, 0, tail));
  return tail;
}

}  // namespace axlecast
