#include "tools/log/log_event.h"

#include <array>
#include <bit>
#include <cstring>

namespace axlecast {
namespace {

constexpr std::size_t kSealSize = 20;
constexpr std::uint32_t kPolynomial = 0x82F63B78;  // 0x1EDC6F41 (RFC 3720, 12.1), its bits reversed
constexpr std::size_t kSlices = 8;

using Tables = std::array<std::array<std::uint32_t, 256>, kSlices>;

// tables[k][b]: the change of the CRC by byte b if k more bytes follow.
constexpr Tables MakeTables() {
  Tables tables{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t crc = byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? kPolynomial : 0);
    tables[0][byte] = crc;
  }
  for (std::size_t k = 1; k < kSlices; ++k) {
    for (std::size_t byte = 0; byte < 256; ++byte) {
      const std::uint32_t crc = tables[k - 1][byte];
      tables[k][byte] = (crc >> 8U) ^ tables[0][crc & 0xFFU];
    }
  }
  return tables;
}

constexpr Tables kTables = MakeTables();

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
  static_assert(std::endian::native == std::endian::little);
  crc = ~crc;
  while (data.size() >= kSlices) {
    std::uint64_t word = 0;
    std::memcpy(&word, data.data(), kSlices);
    word ^= crc;
    crc = 0;
    for (std::size_t k = 0; k < kSlices; ++k) crc ^= kTables[kSlices - 1 - k][word >> (8 * k) & 0xFFU];
    data = data.subspan(kSlices);
  }
  for (const std::uint8_t byte : data) crc = (crc >> 8U) ^ kTables[0][(crc ^ byte) & 0xFFU];
  return ~crc;
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
