// Any bytes as a log: its stretches are in order, without overlap, and end; and undamaged sealed records before them are found.
#include <cstdlib>
#include <vector>

#include "tools/log/sealed_stretches.h"

namespace {

using axlecast::Bytes;
using axlecast::LogPlace;
using axlecast::LogStretch;

void Require(bool holds) {
  if (!holds) std::abort();
}

void ReadFrom(Bytes log, LogPlace place, bool closed) {
  for (;;) {
    const LogStretch stretch = axlecast::NextStretch(log, place, closed);
    Require(stretch.next.offset <= log.size() && stretch.next.offset >= place.offset);
    Require(stretch.next.number >= place.number);
    if (stretch.kind == LogStretch::Kind::kIncomplete) {
      Require(stretch.next == place && (!closed || place.offset == log.size() || place.number > INT64_MAX / 2));
      return;
    }
    Require(stretch.next.offset > place.offset || stretch.next.number > place.number);
    Require(stretch.records.empty() == (stretch.kind == LogStretch::Kind::kDamaged));
    place = stretch.next;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Bytes bytes(data, size);
  ReadFrom(bytes, {}, true);
  ReadFrom(bytes, {}, false);
  const std::int64_t number = size == 0 ? 0 : data[0];
  ReadFrom(bytes, axlecast::FindPlace(bytes, number, size / 2), true);

  std::vector<std::uint8_t> log;
  axlecast::LogEncoder encoder;
  for (std::int64_t i = 0; i < 3; ++i) {
    const Bytes record = encoder.Add({.number = 0, .utime = i, .channel = "A", .data = {}});
    log.insert(log.end(), record.begin(), record.end());
  }
  const Bytes seal = encoder.Seal(3);
  log.insert(log.end(), seal.begin(), seal.end());
  const std::size_t sealed = log.size();
  log.insert(log.end(), bytes.begin(), bytes.end());
  const LogStretch first = axlecast::NextStretch(log, {}, false);
  Require(first.kind == LogStretch::Kind::kSealed && first.next == LogPlace{4, sealed});
  Require(axlecast::FindPlace(log, 4, 0) == first.next && axlecast::FindPlace(log, 4, sealed) == first.next);
  return 0;
}
