#pragma once

#include <string>
#include <utility>
#include <vector>

#include "tools/log/log_fixture.h"
#include "tools/replay/replay.h"

namespace axlecast {

// A message that a replay has sent.
struct PlayedMessage {
  std::string channel;
  std::string data;
  MonoNs at = 0;
  MonoNs due = 0;
  bool operator==(const PlayedMessage&) const = default;
};

// Plays all messages that are due before `until` without delay, and advances `now`. Stops at the end of the replay.
inline std::vector<PlayedMessage> PlayUntil(Replay& replay, MonoNs& now, MonoNs until) {
  std::vector<PlayedMessage> played;
  while (replay.Due() <= until) {
    now = std::max(now, replay.Due());
    if (const auto message = replay.Take(now)) {
      played.push_back({*message->channel, Text(message->data), now, message->due});
    }
  }
  if (until != kNever - 1) now = std::max(now, until);
  return played;
}

inline std::vector<PlayedMessage> PlayToTheEnd(Replay& replay, MonoNs& now) {
  return PlayUntil(replay, now, kNever - 1);
}

inline std::string Channels(const std::vector<PlayedMessage>& played) {
  std::string channels;
  for (const PlayedMessage& message : played) channels += message.channel;
  return channels;
}

}  // namespace axlecast
