#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/messages/sequence_count.h"
#include "tools/recorder/message_queue.h"

namespace axlecast {

struct ChannelLoss {
  std::string channel;
  std::int64_t received = 0;
  std::int64_t lost = 0;
};

// Counts the missing messages of each channel by the `seq` of axlecast's own types. It shows which channels a loss concerns.
// Messages of other types are ignored.
class ChannelLosses {
 public:
  static constexpr std::size_t kMaxChannels = 4'096;  // senders can invent any number of channels

  void On(const LoggedMessage& message);

  [[nodiscard]] std::vector<ChannelLoss> losses() const;  // channels with losses, greatest loss first

 private:
  std::map<std::string, SequenceCount, std::less<>> channels_;
};

}  // namespace axlecast
