#include "tools/convert/mcap.h"

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "core/base/safe_text.h"
#include "core/messages/json/field.h"
#include "core/messages/json/message_json.h"
#include "tools/convert/mcap_writer.h"
#include "tools/convert/sample_time.h"
#include "tools/log/log_event.h"
#include "tools/log/log_seal.h"

namespace axlecast {
namespace {

std::string_view Text(Bytes bytes) {
  return bytes.empty() ? std::string_view()
                       : std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

// Times before 1970, and beyond what 63 bits hold, are wrong clocks.
std::uint64_t Nanoseconds(std::int64_t utime) {
  constexpr std::int64_t kNsPerUs = 1'000;
  if (utime < 0) return 0;
  return static_cast<std::uint64_t>(std::min(utime, INT64_MAX / kNsPerUs) * kNsPerUs);
}

class McapMaking {
 public:
  explicit McapMaking(const Output& out) : writer_(out) {}

  bool On(const LogEvent& event) {
    if (IsLogChannel(event.channel)) {
      Attach(event);
      return writer_.good();
    }
    const MessageType* type = FindMessageType(event.data);
    auto message = type == nullptr ? std::nullopt : type->decode(event.data);
    if (!message) type = nullptr;
    const std::optional<std::uint16_t> channel = Channel(event.channel, type);
    if (!channel) {
      ++done_.left_out;
      return true;
    }
    const std::string json = message ? JsonLine(*message) : "";
    const std::int64_t sequence = message ? message->value("seq", std::int64_t{0}) : event.number;
    writer_.Write({.channel = *channel,
                   .sequence = static_cast<std::uint32_t>(sequence & 0xFFFF'FFFF),
                   .log_ns = Nanoseconds(event.utime),
                   .publish_ns = Nanoseconds(type == nullptr ? event.utime : SampleTime(event)),
                   .data = type == nullptr ? Text(event.data) : std::string_view(json)});
    ++done_.written;
    return writer_.good();
  }
  Conversion Finish() {
    writer_.Finish();
    return done_;
  }

 private:
  void Attach(const LogEvent& event) {
    if (event.channel == kSealChannel) return;
    const bool yaml = event.channel == kMachineChannel;
    const bool json = event.channel == kRecorderChannel;
    writer_.Write(McapWriter::Attachment{
        .name = MendedUtf8(event.channel),
        .media_type = yaml   ? "application/yaml"
                      : json ? "application/json"
                             : "text/plain",
        .log_ns = Nanoseconds(event.utime),
        .data = Text(event.data),
    });
  }

  // Nothing when there are too many. `type`: null of raw messages.
  std::optional<std::uint16_t> Channel(std::string_view name, const MessageType* type) {
    const auto key = std::pair(std::string(name), type);
    const auto known = channels_.find(key);
    if (known != channels_.end()) return known->second;
    if (channels_.size() >= McapWriter::kMaxChannels) return std::nullopt;
    std::uint16_t schema = 0;
    if (type != nullptr) {
      const auto [place, fresh] = schemas_.try_emplace(type, 0);
      if (fresh) place->second = writer_.AddSchema("axlecast." + std::string(type->name), type->schema);
      schema = place->second;
    }
    return channels_[key] = writer_.AddChannel(schema, MendedUtf8(name), type == nullptr ? "lcm" : "json");
  }

  McapWriter writer_;
  std::map<std::pair<std::string, const MessageType*>, std::uint16_t> channels_;
  std::map<const MessageType*, std::uint16_t> schemas_;
  Conversion done_;
};

}  // namespace

Conversion WriteMcap(const EventRange& events, const Output& out) {
  McapMaking mcap(out);
  events([&mcap](const LogEvent& event) { return mcap.On(event); });
  return mcap.Finish();
}

}  // namespace axlecast
