// Whatever a log holds and whatever is asked of its replay, it ends, and what it gives lies in the log.

#include <algorithm>
#include <cstdlib>

#include "tools/replay/replay.h"

namespace axlecast {
namespace {

void Ask(Replay& replay, std::uint8_t what, MonoNs now) {
  switch (what % 8) {
    case 0:
      return replay.Pause(now);
    case 1:
      return replay.Resume(now);
    case 2:
      return replay.Step(now);
    case 3:
      return replay.SetSpeed(what / 8 * 0.25, now);
    case 4:
      return replay.Seek(replay.Utime(now) + (what / 8 - 15) * 1'000'000, now);
    case 5:
      return replay.Seek(what < 128 ? INT64_MIN : INT64_MAX, now);
    default:
      return;
  }
}

void Play(const std::vector<Bytes>& logs, Bytes questions) {
  const auto from = questions.empty() ? 0 : questions[0];
  const ReplayRangeOptions wish{
      .from = (from / 2 - 32) * INT64_C(1'000'000'000), .start_event = from % 4, .end_event = 1'000};
  MonoNs now = kSecond;
  Replay replay(logs, FindRange(logs, wish), {}, {.loop = from % 8 == 7}, now);
  for (const std::uint8_t question : questions) {
    Ask(replay, question, now);
    for (int i = 0; i < 20; ++i) {
      if (replay.Due() != kNever) now = std::max(now, replay.Due());
      const auto message = replay.Take(now);
      if (!message) break;
      const auto holds = [&message](Bytes log) {
        return message->data.empty() || (message->data.data() >= log.data() &&
                                         message->data.data() + message->data.size() <= log.data() + log.size());
      };
      if (std::none_of(logs.begin(), logs.end(), holds) || message->due > now) std::abort();
    }
  }
}

}  // namespace
}  // namespace axlecast

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const axlecast::Bytes bytes(data, size);
  if (size < 16) return 0;
  const std::size_t half = 16 + (size - 16) * bytes[15] / 255;
  axlecast::Play({bytes.subspan(16, half - 16), bytes.subspan(half)}, bytes.first(15));
  return 0;
}
