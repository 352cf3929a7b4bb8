#include "tools/log/log_event.h"

#include <cstring>

#include "tools/log/log_seal.h"

namespace axlecast {

void AppendEvent(std::vector<std::uint8_t>& log, const LogEvent& event) {
  AppendBigEndian(log, kEventSync);
  AppendBigEndian(log, static_cast<std::uint64_t>(event.number));
  AppendBigEndian(log, static_cast<std::uint64_t>(event.utime));
  AppendBigEndian(log, static_cast<std::uint32_t>(event.channel.size()));
  AppendBigEndian(log, static_cast<std::uint32_t>(event.data.size()));
  log.insert(log.end(), event.channel.begin(), event.channel.end());
  log.insert(log.end(), event.data.begin(), event.data.end());
}

std::size_t EventSize(const LogEvent& event) { return kEventHeader + event.channel.size() + event.data.size(); }

std::optional<LogEvent> ParseEvent(Bytes log) {
  if (log.size() < kSmallestEvent || ReadBigEndian<std::uint32_t>(log, 0) != kEventSync) return std::nullopt;
  const std::size_t channel_size = ReadBigEndian<std::uint32_t>(log, 20);
  const std::size_t data_size = ReadBigEndian<std::uint32_t>(log, 24);
  if (channel_size == 0 || channel_size > kLongestLogChannel || data_size > kLargestLogData) return std::nullopt;
  if (channel_size + data_size > log.size() - kEventHeader) return std::nullopt;
  const Bytes channel = log.subspan(kEventHeader, channel_size);
  if (std::memchr(channel.data(), 0, channel.size()) != nullptr) return std::nullopt;
  LogEvent event;
  event.number = static_cast<std::int64_t>(ReadBigEndian<std::uint64_t>(log, 4));
  event.utime = static_cast<std::int64_t>(ReadBigEndian<std::uint64_t>(log, 12));
  event.channel = {reinterpret_cast<const char*>(channel.data()), channel.size()};
  event.data = log.subspan(kEventHeader + channel_size, data_size);
  return event;
}

bool IsLogChannel(std::string_view channel) {
  return channel == kMachineChannel || channel == kSchemaChannel || channel == kRecorderChannel ||
         channel == kSealChannel;
}

}  // namespace axlecast
