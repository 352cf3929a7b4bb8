#include "tools/recorder/channel_filter.h"

namespace axlecast {
namespace {

constexpr std::size_t kRemembered = 10'000;  // channels; anybody may invent more

}  // namespace

bool ChannelFilter::Wants(std::string_view channel) {
  if (const auto found = known_.find(channel); found != known_.end()) return found->second;
  if (known_.size() >= kRemembered) known_.clear();
  const bool wants = std::regex_search(channel.begin(), channel.end(), channel_) != invert_;
  known_.emplace(channel, wants);
  return wants;
}

}  // namespace axlecast
