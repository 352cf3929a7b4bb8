#include "tools/log/log_tail.h"

#include "tools/log/log_reader.h"

namespace axlecast {
namespace {

// Many times what stands between two seals; must hold the largest record, and more.
constexpr std::size_t kFirstLook = 4 * kLargestLogData;

// Whether the end could be judged from `begin` on: a seal stands there, or nothing is before.
bool ReadTail(Bytes log, std::size_t begin, LogTail& tail) {
  bool sealed = begin == 0;
  LogReader reader(log, begin);
  for (auto event = reader.Next(); event; event = reader.Next()) {
    tail.size = reader.position();
    tail.next_number = event->number < 0 || event->number == INT64_MAX ? 0 : event->number + 1;
    tail.utime = event->utime;
    if (event->channel == kSealChannel) {
      tail.open.Reset();
      sealed = true;
    } else {
      tail.open.Add(log.subspan(reader.offset(), EventSize(*event)));
    }
  }
  return sealed;
}

}  // namespace

LogTail FindTail(Bytes log) {
  LogTail tail;
  if (log.size() > kFirstLook && ReadTail(log, log.size() - kFirstLook, tail)) return tail;
  tail = {};
  static_cast<void>(ReadTail(log, 0, tail));
  return tail;
}

}  // namespace axlecast
