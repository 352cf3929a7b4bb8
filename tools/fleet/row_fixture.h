#pragma once

#include <axlecast/alarm_t.hpp>
#include <axlecast/command_status_t.hpp>
#include <axlecast/device_info_t.hpp>
#include <axlecast/position_block_t.hpp>
#include <axlecast/position_t.hpp>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "core/messages/message.h"
#include "core/messages/origin.h"
#include "tools/fleet/row_composer.h"

namespace axlecast {

// For tests: a machine with two axes and one log, and messages of it.

inline constexpr std::int64_t kT0 = 1'790'000'000'000'000;  // us, in 2026; begin of a second
inline constexpr UtimeRange kThisYear{.first = 1'767'225'600'000'000, .end = 1'798'761'600'000'000};
inline constexpr std::int64_t kBoot = 0x1234;

inline LogConfig LogNamed(const std::string& name, const std::string& channels, const std::string& trigger = "") {
  LogConfig log;
  log.name = name;
  log.channels = channels;
  log.trigger = trigger;
  return log;
}

inline LogFacts PressFacts() {
  LogFacts facts{.machine = "press3", .prefix = "", .devices = {}, .logs = {}};
  facts.devices["axis1"] = {
      .counts_per_turn = 131'072, .unit = position_t::UNIT_MM, .unit_per_count = 5.0 / 131'072};
  facts.devices["axis2"] = facts.devices["axis1"];
  facts.logs.push_back(LogNamed("all", ""));
  return facts;
}

inline DetailRules Rules(std::vector<std::pair<std::string, ChannelDetail>> list) {
  DetailRules rules;
  for (const auto& [channels, detail] : list) {
    if (!rules.Add(channels, detail)) std::abort();
  }
  return rules;
}

// A composer, and the log that it reads.
class ComposerFixture {
 public:
  explicit ComposerFixture(DetailRules rules = {}, LogFacts facts = PressFacts(), const std::string& log = "all")
      : composer_(std::move(facts), log, std::move(rules), kThisYear) {}

  template <typename Message>
  ComposerFixture& Add(const std::string& channel, const Message& message) {
    return AddBytes(channel, Encoded(message), message.utime + 500);
  }
  ComposerFixture& AddBytes(const std::string& channel, Bytes data, std::int64_t received = kT0) {
    composer_.Add({.number = events_++, .utime = received, .channel = channel, .data = data});
    return *this;
  }
  template <typename Message>
  ComposerFixture& Prime(const std::string& channel, const Message& message) {
    const auto data = Encoded(message);
    composer_.Prime({.number = 0, .utime = message.utime, .channel = channel, .data = data});
    return *this;
  }
  BatchRows Take() { return composer_.Take(); }
  [[nodiscard]] std::int64_t events() const { return events_; }
  RowComposer& composer() { return composer_; }

 private:
  RowComposer composer_;
  std::int64_t events_ = 0;
};

template <typename Message>
Message MessageAt(std::int64_t utime, std::int64_t seq) {
  Message message{};
  message.utime = utime;
  message.mono_ns = (utime - kT0) * 1'000 + 77;
  message.boot_id = kBoot;
  message.seq = seq;
  message.machine_id = NameHash("press3");
  return message;
}

// Sample `i` of an axis that moves at 100 counts a message, 250 Hz.
inline position_t PositionAt(std::int64_t i) {
  auto message = MessageAt<position_t>(kT0 + i * 4'000, i);
  message.tick = -1;
  message.counts_per_turn = 131'072;
  message.counts = 1'000 + 100 * i;
  message.raw_counts = message.counts;
  message.angle_rad = static_cast<double>(message.counts) / 131'072 * 2 * 3.14159265358979323846;
  message.value = static_cast<double>(message.counts) * (5.0 / 131'072);
  message.unit = position_t::UNIT_MM;
  message.speed_rad_s = 1.2345678901234;
  message.flags = std::int32_t{position_t::FLAG_VALID} | position_t::FLAG_SPEED_VALID;
  return message;
}

inline alarm_entry_t Alarm(std::int32_t code, std::int64_t first_utime,
                           std::int8_t state = alarm_entry_t::STATE_LIVE) {
  alarm_entry_t entry{};
  entry.code = code;
  entry.severity = alarm_entry_t::SEVERITY_ERROR;
  entry.state = state;
  entry.first_utime = first_utime;
  entry.last_utime = first_utime;
  entry.count = 1;
  entry.name = "alarm_" + std::to_string(code);
  entry.action = "replace the battery";
  return entry;
}

inline alarm_t AlarmsAt(std::int64_t utime, std::int64_t seq, std::vector<alarm_entry_t> entries) {
  auto message = MessageAt<alarm_t>(utime, seq);
  message.device = "axis1";
  message.total = static_cast<std::int16_t>(entries.size());
  message.n = static_cast<std::int8_t>(entries.size());
  message.entries = std::move(entries);
  return message;
}

}  // namespace axlecast
