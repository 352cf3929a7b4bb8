#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"

namespace axlecast {

// Compares recorded readings (position_t, motor_health_t) with the same readings decoded again. They are matched by channel and
// sampling time. All fields are compared, except FLAG_REDECODED and `seq`: a recording may begin in the middle. The readings of
// each side must come in the order of their times.
class RecordingDiff {
 public:
  void OnRecorded(const std::string& channel, Bytes message) { Add(channel, message, kRecorded); }
  void OnRedecoded(const std::string& channel, Bytes message) { Add(channel, message, kRedecoded); }
  // Counts the readings that no reading of the other side matches.
  void Finish();

  struct Field {
    std::string name;
    nlohmann::ordered_json recorded;
    nlohmann::ordered_json redecoded;
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
    std::vector<std::uint8_t> message;  // without the fields that must differ
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
