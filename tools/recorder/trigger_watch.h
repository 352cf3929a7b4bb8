#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <utility>

#include "tools/recorder/logged_message.h"

namespace axlecast {

// Says when something happens that a recording is about. An alarm triggers when it appears, if the expression is found
// in "<channel> <alarm's name>", e.g. "ALARM/axis1 battery_error"; one that had appeared before the watch began does not.
// A message of any other type triggers, each time, if the expression is found in its channel's name.
class TriggerWatch {
 public:
  // `utime`: when the watch begins (us, UNIX time).
  TriggerWatch(std::regex trigger, std::int64_t utime) : trigger_(std::move(trigger)), began_(utime) {}

  [[nodiscard]] bool Fires(const LoggedMessage& message);
  [[nodiscard]] std::size_t remembered() const;  // names of alarms, over all channels

 private:
  std::regex trigger_;
  std::int64_t began_;
  std::map<std::string, std::set<std::string>, std::less<>> standing_;  // alarms of each channel
};

}  // namespace axlecast
