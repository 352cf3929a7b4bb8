// Answers of client/axlecast/position_tracker.h: reads a script, and prints a line for each of its lines. test_tracker.py writes the
// script and compares the answers with those of the Python tracker.
//
// A line is a word, then key=value. All values are numbers in the units of the messages, instants in ns. Floating-point numbers are
// printed in hexadecimal, so that they are exact.
#include <axlecast/position_tracker.h>

#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <map>
#include <memory>
#include <sstream>
#include <string>

namespace {

using axlecast::PositionTracker;
using axlecast::TimeBase;

class Line {
 public:
  explicit Line(const std::string& text) {
    std::istringstream words(text);
    words >> command_;
    for (std::string word; words >> word;) {
      const std::size_t equal = word.find('=');
      values_[word.substr(0, equal)] = word.substr(equal + 1);
    }
  }

  [[nodiscard]] const std::string& command() const { return command_; }
  [[nodiscard]] long long Int(const std::string& key) const {
    return std::strtoll(Value(key).c_str(), nullptr, 10);
  }
  [[nodiscard]] double Double(const std::string& key) const { return std::strtod(Value(key).c_str(), nullptr); }

 private:
  [[nodiscard]] const std::string& Value(const std::string& key) const {
    const auto found = values_.find(key);
    if (found != values_.end()) return found->second;
    std::cerr << command_ << " needs " << key << '\n';
    std::exit(2);
  }

  std::string command_;
  std::map<std::string, std::string> values_;
};

// A new tracker with the options of the line.
struct Case {
  explicit Case(const Line& line) {
    PositionTracker::Options options;
    options.max_age_ns = line.Int("max_age_ns");
    options.max_extrapolation_ns = line.Int("max_extrapolation_ns");
    options.max_gap_ns = line.Int("max_gap_ns");
    options.machine_id = line.Int("machine_id");
    options.clock_id = line.Int("clock_id");
    options.time = line.Int("time") != 0 ? &time : nullptr;
    options.max_time_half_width_ns = line.Int("max_time_half_width_ns");
    options.instant = static_cast<PositionTracker::Options::Instant>(line.Int("instant"));
    tracker = PositionTracker(options);
  }

  TimeBase time;
  PositionTracker tracker;
};

axlecast::position_t PositionOf(const Line& line) {
  axlecast::position_t message{};
  message.mono_ns = line.Int("mono_ns");
  message.boot_id = line.Int("boot_id");
  message.seq = line.Int("seq");
  message.machine_id = line.Int("machine_id");
  message.clock_id = line.Int("clock_id");
  message.time_uncertainty_ns = static_cast<std::int32_t>(line.Int("time_uncertainty_ns"));
  message.missed = static_cast<std::int32_t>(line.Int("missed"));
  message.counts_per_turn = line.Int("counts_per_turn");
  message.counts = line.Int("counts");
  message.speed_rad_s = line.Double("speed_rad_s");
  message.datum_epoch = static_cast<std::int32_t>(line.Int("datum_epoch"));
  message.flags = static_cast<std::int32_t>(line.Int("flags"));
  return message;
}

axlecast::device_info_t DeviceOf(const Line& line) {
  axlecast::device_info_t message{};
  message.boot_id = line.Int("boot_id");
  message.machine_id = line.Int("machine_id");
  message.poll_us = static_cast<std::int32_t>(line.Int("poll_us"));
  message.publish_us = static_cast<std::int32_t>(line.Int("publish_us"));
  message.max_age_us = static_cast<std::int32_t>(line.Int("max_age_us"));
  message.counts_per_turn = line.Int("counts_per_turn");
  message.ratio_num = line.Int("ratio_num");
  message.ratio_den = line.Int("ratio_den");
  message.per_turn = line.Double("per_turn");
  message.modulo = line.Double("modulo");
  return message;
}

axlecast::time_quality_t TimeOf(const Line& line) {
  axlecast::time_quality_t message{};
  message.clock_id = line.Int("clock_id");
  message.boot_id = line.Int("boot_id");
  message.machine_id = line.Int("machine_id");
  message.mono_ns = line.Int("mono_ns");
  message.base_ns = line.Int("base_ns");
  message.base_id = line.Int("base_id");
  message.epoch = static_cast<std::int32_t>(line.Int("epoch"));
  message.half_width_ns = line.Int("half_width_ns");
  message.grade = static_cast<std::int8_t>(line.Int("grade"));
  message.growth_ppb = static_cast<std::int32_t>(line.Int("growth_ppb"));
  message.valid_ms = static_cast<std::int32_t>(line.Int("valid_ms"));
  return message;
}

void Print(const PositionTracker::Position& position) {
  std::printf("%d %a %a %a %d %d\n", static_cast<int>(position.answer), position.counts, position.value,
              position.timing_error_counts, position.flags, position.datum_epoch);
}

void Print(const TimeBase::Instant& instant) {
  std::printf("%d %lld %lld %lld\n", static_cast<int>(instant.answer), static_cast<long long>(instant.ns),
              static_cast<long long>(instant.half_width_ns), static_cast<long long>(instant.base_id));
}

void Print(const PositionTracker::News& news) {
  std::printf("%d %d %d %lld\n", news.used, news.restarted, news.datum_changed, static_cast<long long>(news.lost));
}

void Print(const PositionTracker::Totals& totals) {
  std::printf("%lld %lld %lld %lld %lld %lld %d %lld\n", static_cast<long long>(totals.received),
              static_cast<long long>(totals.lost), static_cast<long long>(totals.late),
              static_cast<long long>(totals.restarts), static_cast<long long>(totals.datum_changes),
              static_cast<long long>(totals.missed_readings), totals.two_publishers,
              static_cast<long long>(totals.other_machine));
}

// Returns false if there is no such command.
bool Answer(Case& current, const Line& line) {
  const std::string& command = line.command();
  if (command == "position") {
    Print(current.tracker.OnPosition(PositionOf(line), line.Int("received_ns")));
  } else if (command == "device") {
    current.tracker.OnDevice(DeviceOf(line));
    std::puts("");
  } else if (command == "time") {
    current.time.OnTime(TimeOf(line), line.Int("now_ns"));
    std::puts("");
  } else if (command == "check") {
    std::printf("%d\n", static_cast<int>(current.tracker.Check(line.Int("ns"))));
  } else if (command == "age") {
    std::printf("%lld\n", static_cast<long long>(current.tracker.AgeNs(line.Int("ns"))));
  } else if (command == "at") {
    Print(current.tracker.At(line.Int("ns")));
  } else if (command == "newest") {
    Print(current.tracker.Newest(line.Int("ns")));
  } else if (command == "totals") {
    Print(current.tracker.totals());
  } else if (command == "on_clock") {
    Print(current.time.OnClock(line.Int("clock_id"), line.Int("of"), line.Int("ns"), line.Int("now_ns")));
  } else {
    return false;
  }
  return true;
}

}  // namespace

int main() {
  std::unique_ptr<Case> current;
  for (std::string text; std::getline(std::cin, text);) {
    const Line line(text);
    if (line.command() == "case") {
      current = std::make_unique<Case>(line);
      std::puts("");
    } else if (current == nullptr || !Answer(*current, line)) {
      std::cerr << "not a line of a script: " << text << '\n';
      return 2;
    }
  }
  return 0;
}
