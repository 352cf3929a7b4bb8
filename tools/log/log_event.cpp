#include "tools/log/log_event.h"

#include <isa-l/crc.h>

#include <algorithm>
#include <cstring>

namespace axlecast {
namespace {

constexpr std::size_t kSealSize = 20;
constexpr std::size_t kCrcPiece = 1U << 30;  // bytes of one call: libisal counts in int

}  // namespace

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
  event.channel = AsText(channel);
  event.data = log.subspan(kEventHeader + channel_size, data_size);
  return event;
}

std::vector<std::uint8_t> EncodeSeal(const LogSeal& seal) {
  std::vector<std::uint8_t> data;
  data.reserve(kSealSize);
  AppendBigEndian(data, seal.bytes);
  AppendBigEndian(data, seal.events);
  AppendBigEndian(data, seal.crc32c);
  return data;
}

std::optional<LogSeal> ParseSeal(Bytes data) {
  if (data.size() != kSealSize) return std::nullopt;
  return LogSeal{.bytes = ReadBigEndian<std::uint64_t>(data, 0),
                 .events = ReadBigEndian<std::uint64_t>(data, 8),
                 .crc32c = ReadBigEndian<std::uint32_t>(data, 16)};
}

std::uint32_t Crc32c(std::uint32_t crc, Bytes data) {
  while (!data.empty()) {
    const Bytes piece = data.first(std::min(data.size(), kCrcPiece));
    // It reads only, although its parameter is not const.
    crc = ~crc32_iscsi(const_cast<unsigned char*>(piece.data()), static_cast<int>(piece.size()), ~crc);
    data = data.subspan(piece.size());
  }
  return crc;
}

void SealCount::Add(Bytes record) {
  seal_.bytes += record.size();
  ++seal_.events;
  seal_.crc32c = Crc32c(seal_.crc32c, record);
}

Bytes LogEncoder::Add(const LogEvent& event) {
  LogEvent numbered = event;
  numbered.number = number_++;
  record_.clear();
  AppendEvent(record_, numbered);
  bytes_ += record_.size();
  if (event.channel != kSealChannel) open_.Add(record_);
  return record_;
}

Bytes LogEncoder::Seal(std::int64_t utime) {
  if (open_.seal().events == 0) return {};
  const std::vector<std::uint8_t> seal = EncodeSeal(open_.seal());
  open_.Reset();
  return Add({.utime = utime, .channel = kSealChannel, .data = seal});
}

bool IsLogChannel(std::string_view channel) {
  return channel == kMachineChannel || channel == kSchemaChannel || channel == kRecorderChannel ||
         channel == kSealChannel;
}

}  // namespace axlecast
