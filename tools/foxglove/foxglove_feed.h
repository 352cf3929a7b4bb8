#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/base/inline_bytes.h"
#include "tools/foxglove/foxglove_frames.h"
#include "tools/foxglove/lcm_definition.h"
#include "tools/foxglove/ros_schema.h"

namespace axlecast {

// The channels of LCM messages, as Foxglove channels. A channel exists from its first message on. If the type of its messages changes,
// it is another channel.
class FoxgloveFeed {
 public:
  static constexpr std::size_t kMaxChannels = 4'096;  // anybody on the network can invent names

  // `definitions` must outlive the object.
  explicit FoxgloveFeed(const LcmDefinitions& definitions) : definitions_(definitions) {}

  // What a message means for the viewers.
  struct News {
    const FoxgloveChannel* channel = nullptr;  // null: it cannot be shown
    const RosSchema* schema = nullptr;
    bool advertise = false;         // the channel is new
    std::uint32_t unadvertise = 0;  // not 0: the channel that it replaces
    std::string problem;            // why it cannot be shown, if that is new
  };
  // `name`: of the LCM channel. The pointers are valid until the channel is replaced.
  [[nodiscard]] News On(const std::string& name, Bytes message);

  // Returns the channels that exist, and why others cannot be shown.
  [[nodiscard]] std::vector<const FoxgloveChannel*> Channels() const;
  [[nodiscard]] const std::vector<std::string>& problems() const { return problems_; }
  [[nodiscard]] bool Knows(std::uint32_t channel) const;

 private:
  struct Channel {
    std::int64_t fingerprint = 0;
    FoxgloveChannel channel;  // id 0: it cannot be shown
    const RosSchema* schema = nullptr;
  };

  [[nodiscard]] const RosSchema* SchemaOf(std::int64_t fingerprint);
  void Report(const std::string& problem, News& news);

  const LcmDefinitions& definitions_;
  std::map<std::string, Channel> channels_;
  std::map<std::int64_t, std::unique_ptr<RosSchema>> schemas_;
  std::vector<std::string> problems_;
  std::uint32_t last_id_ = 0;
};

}  // namespace axlecast
