#pragma once

#include <axlecast/recorder_health_t.hpp>
#include <cstdint>
#include <string>
#include <utility>

#include "core/base/time.h"
#include "tools/recorder/recording_session.h"

namespace axlecast {

// What a recorder publishes of itself on RECORDER/<name>.
class RecordingHealth {
 public:
  RecordingHealth(std::string name, std::int64_t boot_id) : name_(std::move(name)), boot_id_(boot_id) {}

  // Rates are those since the call before. `utime`: us, UNIX time of `now`.
  [[nodiscard]] recorder_health_t Make(const RecordingStatus& status, MonoNs now, std::int64_t utime,
                                       bool stopping);

 private:
  std::string name_;
  std::int64_t boot_id_;
  std::int64_t seq_ = 0;
  MonoNs before_ = 0;
  std::int64_t messages_before_ = 0;
  std::int64_t bytes_before_ = 0;
};

// "192.0.2.1:40123".
[[nodiscard]] std::string SenderText(const SenderAddress& sender);

}  // namespace axlecast
