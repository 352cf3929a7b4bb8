#pragma once

#include <optional>
#include <string>

namespace axlecast {

// Names of channels on which messages of a running machine came within about 1.2 s (every driver tells its state once a
// second), for people; empty when none came. A recorder's own messages do not count. Nothing when the URL cannot be heard;
// `problem` then says why.
[[nodiscard]] std::optional<std::string> HearLiveMachine(const std::string& url, std::string& problem);

}  // namespace axlecast
