#pragma once

#include <cstddef>
#include <optional>
#include <set>
#include <string>

#include "core/base/inline_bytes.h"

namespace axlecast {

// The channels on which messages of a running machine come. Pure.
class LiveChannels {
 public:
  static constexpr std::size_t kMaxChannels = 1'000;  // anybody may invent more

  void On(const std::string& channel, Bytes message);

  [[nodiscard]] std::size_t size() const { return channels_.size(); }
  // The first few names and how many more there are, for people; empty when no message came.
  [[nodiscard]] std::string Text() const;

 private:
  std::set<std::string> channels_;
};

// Names of channels on which messages of a running machine came within about 1.2 s (every driver tells its state once a
// second), for people; empty when none came. A recorder's own messages do not count. Nothing when the URL cannot be heard;
// `problem` then says why.
[[nodiscard]] std::optional<std::string> HearLiveMachine(const std::string& url, std::string& problem);

}  // namespace axlecast
