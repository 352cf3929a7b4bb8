#include "tests/differential/random_streams.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

namespace axlecast {
namespace {

constexpr std::size_t kNames = 2'000;  // liblcm keeps every name that it has received
constexpr std::size_t kLongestName = 63;
constexpr std::size_t kLargestUdp = 65'507;
constexpr std::size_t kLargestShort = kLargestUdp - 8;      // channel, NUL and payload
constexpr std::size_t kLargestFragment = kLargestUdp - 20;  // the same, or a part of the payload
constexpr std::uint32_t kShort = 0x4c433032;
constexpr std::uint32_t kFragment = 0x4c433033;

std::string BigEndian(std::uint32_t value, int bytes) {
  std::string text;
  for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8) text += static_cast<char>((value >> shift) & 0xff);
  return text;
}

std::string ShortDatagram(std::uint32_t sequence, const std::string& channel, const std::string& payload) {
  return BigEndian(kShort, 4) + BigEndian(sequence, 4) + channel + '\0' + payload;
}

}  // namespace

std::string EndDatagram(std::uint32_t number) { return ShortDatagram(number, kEndChannel, BigEndian(number, 4)); }

RandomStreams::RandomStreams(std::uint32_t seed) : random_(seed) {
  for (std::size_t i = 0; i < kNames; ++i) names_.push_back(Name());
  // Some senders pass 2^32 soon.
  for (std::size_t i = 0; i < kSenders; ++i) next_.push_back(i % 2 == 0 ? 0 : 0xffffff00U + Number() % 0x100);
}

std::string RandomStreams::Bytes(std::size_t size) {
  std::string bytes(size, '\0');
  const std::uint32_t first = Number();
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<char>((first >> (i % 4 * 8)) ^ (i * 167));
  return bytes;
}

// UTF-8 without NUL. liblcm matches names as UTF-8 against its subscriptions, and passes on no others.
std::string RandomStreams::Name() {
  static const std::array<const char*, 12> kPieces = {"POSITION/", "axis", ".*",     "^$",           "\n", " ",
                                                      "\xc3\xa9",  "\"",   "\x01\\", "\xe2\x82\xac", "A",  "/"};
  std::string name;
  const std::size_t size = OneIn(4) ? kLongestName : 1 + Below(kLongestName);
  while (name.size() < size) {
    const std::string piece = kPieces[Below(kPieces.size())];
    name += name.size() + piece.size() <= size ? piece : std::string(1, static_cast<char>('a' + Below(26)));
  }
  return name == kEndChannel ? "end" : name;
}

void RandomStreams::AddShort(Track& track, std::uint32_t sequence, LcmStream& stream) {
  const std::string& name = names_[Below(names_.size())];
  const LcmMessage message{name, Bytes(OneIn(8) ? 0 : OneIn(20) ? 1'400 + Below(200) : Below(120))};
  track.datagrams.push_back(ShortDatagram(sequence, name, message.data));
  track.complete.push_back({message});
  if (OneIn(30)) {  // a copy by the network is passed on, too
    track.datagrams.push_back(track.datagrams.back());
    track.complete.push_back({message});
  }
  if (OneIn(15)) {
    track.datagrams.push_back(Refused());
    track.complete.emplace_back();
    ++stream.refused;
  }
}

// Fragment 0 comes first, because liblcm drops the others without it; the others in any order, with short messages among them.
void RandomStreams::AddFragments(Track& track, std::size_t sender, LcmStream& stream) {
  static const std::array<std::size_t, 6> kSizes = {1, 2, 8, 100, 1'000, 1'400};
  const std::size_t part = kSizes[Below(kSizes.size())];
  const std::size_t fragments = 1 + Below(part > 100 ? 4 : 9);
  // One byte less than full fragments, full ones, or one byte more, which goes into one fragment more.
  std::size_t size = part * fragments - (part > 1 && OneIn(3) ? 1 : 0) + (OneIn(3) ? 1 : 0);
  const std::size_t first = OneIn(5) ? 0 : std::min(part, size);
  if (first == size && OneIn(2)) size = 0;
  const std::size_t rest = size < first ? 0 : size - first;
  const std::size_t head = std::min(first, size);
  const std::size_t count = 1 + (rest + part - 1) / part;
  const LcmMessage message{names_[Below(names_.size())], Bytes(size)};
  const std::uint32_t sequence = next_[sender]++;
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (OneIn(2)) std::shuffle(order.begin() + 1, order.end(), random_);
  const bool loses_one = count > 1 && OneIn(12);
  if (loses_one) order.erase(order.begin() + static_cast<std::ptrdiff_t>(Below(count)));
  for (const std::size_t number : order) {
    const std::size_t offset = number == 0 ? 0 : head + (number - 1) * part;
    const std::size_t bytes = number == 0 ? head : std::min(part, size - offset);
    std::string datagram =
        BigEndian(kFragment, 4) + BigEndian(sequence, 4) + BigEndian(static_cast<std::uint32_t>(size), 4) +
        BigEndian(static_cast<std::uint32_t>(offset), 4) + BigEndian(static_cast<std::uint32_t>(number), 2) +
        BigEndian(static_cast<std::uint32_t>(count), 2);
    if (number == 0) datagram += message.channel + '\0';
    track.datagrams.push_back(datagram + message.data.substr(offset, bytes));
    track.complete.emplace_back();
    if (number != order.back() && OneIn(10)) AddShort(track, next_[sender]++, stream);
  }
  if (loses_one) {
    ++stream.refused;
  } else {
    track.complete.back().push_back(message);
    ++stream.fragmented;
  }
}

// Datagrams that are not of LCM, or name no channel that LCM permits.
std::string RandomStreams::Refused() {
  switch (Below(3)) {
    case 0:
      return Bytes(Below(8));
    case 1:
      return BigEndian(kShort ^ (2U << Below(31)), 4) + BigEndian(Number(), 4) + std::string("A\0b", 3);
    default:
      return ShortDatagram(Number(), std::string(kLongestName + 1 + Below(100), 'N'), Bytes(Below(50)));
  }
}

RandomStreams::Track RandomStreams::MakeTrack(std::size_t sender, LcmStream& stream) {
  Track track;
  for (std::size_t messages = 1 + Below(3); messages > 0; --messages) {
    if (OneIn(3)) {
      AddFragments(track, sender, stream);
    } else {
      AddShort(track, next_[sender]++, stream);
    }
  }
  return track;
}

// A message about as long as one, two or three of the largest datagrams, in the datagrams of a real sender.
void RandomStreams::AddPublished(LcmStream& stream) {
  SenderStep step{
      .kind = OneIn(2) ? SenderStep::Kind::kLiblcm : SenderStep::Kind::kGroupSender, .datagram = {}, .message = {}};
  step.message.channel = names_[Below(names_.size())];
  const std::size_t head = step.message.channel.size() + 1;
  static const std::array<std::size_t, 5> kAround = {kLargestShort, kLargestFragment, 2 * kLargestFragment, 1'400,
                                                     0};
  const std::size_t whole = kAround[Below(kAround.size())] + Below(5);
  const std::size_t size = whole > head + 2 ? whole - head - 2 : Below(10);
  step.message.data = Bytes(size);
  stream.fragmented += head + size > kLargestShort ? 1 : 0;
  stream.messages.push_back(step.message);
  stream.steps.push_back(std::move(step));
}

LcmStream RandomStreams::Next() {
  LcmStream stream;
  std::array<std::size_t, kSenders> senders{};
  std::iota(senders.begin(), senders.end(), std::size_t{0});
  std::shuffle(senders.begin(), senders.end(), random_);
  std::vector<std::pair<std::size_t, Track>> tracks;
  for (std::size_t i = 1 + Below(3); i > 0; --i) tracks.emplace_back(senders[i], MakeTrack(senders[i], stream));
  if (OneIn(50)) AddPublished(stream);
  while (!tracks.empty()) {
    const std::size_t chosen = Below(tracks.size());
    auto& [sender, track] = tracks[chosen];
    stream.steps.push_back({.sender = sender, .datagram = std::move(track.datagrams[track.sent]), .message = {}});
    for (LcmMessage& message : track.complete[track.sent]) stream.messages.push_back(std::move(message));
    if (++track.sent == track.datagrams.size()) tracks.erase(tracks.begin() + static_cast<std::ptrdiff_t>(chosen));
  }
  return stream;
}

}  // namespace axlecast
