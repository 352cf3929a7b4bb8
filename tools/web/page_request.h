#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace axlecast {

// What a page may ask for (docs/web_protocol.md). None of it reaches a device.
struct SubscribeRequest {
  std::vector<std::string> devices = {};
  double history_s = 0;
  bool operator==(const SubscribeRequest&) const = default;
};
struct SeekRequest {
  std::int64_t utime = 0;
  bool operator==(const SeekRequest&) const = default;
};
struct PlayRequest {
  bool play = true;  // false: pause
  bool operator==(const PlayRequest&) const = default;
};
struct SpeedRequest {
  double factor = 1;
  bool operator==(const SpeedRequest&) const = default;
};
struct BadRequest {
  std::string text;  // what is wrong with it
  bool operator==(const BadRequest&) const = default;
};
using PageRequest = std::variant<BadRequest, SubscribeRequest, SeekRequest, PlayRequest, SpeedRequest>;

inline constexpr std::size_t kMaxSubscribed = 512;
inline constexpr double kSlowestPlay = 0.01;
inline constexpr double kFastestPlay = 100;

[[nodiscard]] PageRequest ParsePageRequest(std::string_view text);

}  // namespace axlecast
