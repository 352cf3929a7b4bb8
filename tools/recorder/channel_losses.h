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

// What is missing on each channel by the `seq` of axlecast's own types, which says whose messages a sender's loss hit.
// Messages of other types are passed over.
class ChannelLosses {
 public:
  static constexpr std::size_t kMaxChannels = 4'096;  // anybody may invent more

  void On(const LoggedMessage& message);

  [[nodiscard]] std::vector<ChannelLoss> losses() const;  // channels that lost something, most first

 private:
  std::map<std::string, SequenceCount, std::less<>> channels_;
};

}  // namespace axlecast
