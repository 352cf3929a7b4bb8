#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"

namespace axlecast {

// Compares readings (position_t, motor_health_t) as they were recorded with the same ones decoded again. They are
// matched by channel and sampling instant, and compared whole but for what must differ: FLAG_REDECODED, and `seq`,
// because a recording may begin in the middle. Both sides come in the order of their instants.
class RecordingDiff {
 public:
  void OnRecorded(const std::string& channel, Bytes message) { Add(channel, message, kRecorded); }
  void OnRedecoded(const std::string& channel, Bytes message) { Add(channel, message, kRedecoded); }
  // What still waits for its other half has none.
  void Finish();

  struct Field {
    std::string name;
    std::string recorded;   // as JSON
    std::string redecoded;  // as JSON
  };
  struct Difference {
    MonoNs mono_ns = 0;
    std::vector<Field> fields;
  };
  struct Tally {
    std::int64_t equal = 0;
    std::int64_t differing = 0;
    std::int64_t only_recorded = 0;
    std::int64_t only_redecoded = 0;
    std::vector<Difference> first;  // of those that differ, at most kShown

    [[nodiscard]] bool same() const { return differing + only_recorded + only_redecoded == 0; }
  };
  static constexpr std::size_t kShown = 5;
  [[nodiscard]] std::map<std::string, Tally> tallies() const;  // by channel
  [[nodiscard]] bool same() const;

 private:
  enum Side { kRecorded, kRedecoded };
  struct Reading {
    MonoNs mono_ns = 0;
    std::vector<std::uint8_t> message;  // without what must differ
  };
  struct Channel {
    std::deque<Reading> waiting[2];
    Tally tally;
  };

  void Add(const std::string& channel, Bytes message, Side side);
  static void Match(Channel& channel);
  static void Compare(const Reading& recorded, const Reading& redecoded, Tally& tally);

  std::map<std::string, Channel> channels_;
};

}  // namespace axlecast
