// Any bytes as a log: events and damage must cover it, in order and without overlap; reading must begin anywhere; and
// undamaged events of a log around it must be found.
#include <cstdlib>
#include <vector>

#include "tools/log/log_event.h"
#include "tools/log/log_reader.h"

namespace {

using axlecast::Bytes;
using axlecast::LogReader;

void Require(bool holds) {
  if (!holds) std::abort();
}

void ReadFrom(Bytes log, std::size_t begin) {
  LogReader reader(log, begin);
  std::size_t position = begin;
  std::size_t covered = 0;
  for (auto event = reader.Next(); event; event = reader.Next()) {
    Require(reader.offset() >= position && reader.position() == reader.offset() + axlecast::EventSize(*event));
    position = reader.position();
    covered += axlecast::EventSize(*event);
  }
  Require(reader.position() == log.size());
  for (const LogReader::Damage& damage : reader.damage()) covered += damage.size;
  Require(begin > 0 || covered == log.size());
}

// The events before what is no log are found whatever it holds.
void ReadBehindOthers(Bytes log) {
  std::vector<std::uint8_t> whole;
  for (std::int64_t i = 0; i < 4; ++i) {
    axlecast::AppendEvent(whole, {.number = i, .utime = i, .channel = "A", .data = {}});
  }
  const std::size_t before = whole.size();
  whole.insert(whole.end(), log.begin(), log.end());
  LogReader reader(whole);
  for (std::size_t end = before / 4; end <= before; end += before / 4) {
    Require(reader.Next().has_value() && reader.position() == end);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Bytes log(data, size);
  ReadFrom(log, 0);
  ReadFrom(log, size / 2);
  ReadBehindOthers(log);
  Require(axlecast::SeekTime(log, 1'790'000'000'000'000) <= size);
  Require(axlecast::FindTail(log).size <= size);
  return 0;
}
