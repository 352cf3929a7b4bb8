#include "tools/axlecast/live/message_watch.h"

#include <array>
#include <cstdio>

#include "core/base/text.h"
#include "core/messages/json/field.h"
#include "core/messages/json/message_json.h"
#include "tools/axlecast/live/describe.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kOthersKept = 100;
constexpr std::size_t kOthersNamed = 8;
constexpr std::size_t kRowWidth = 200;  // a wide terminal shows more

bool Matches(const std::regex& pattern, const std::string& channel) {
  try {
    return std::regex_search(channel, pattern);
  } catch (const std::regex_error&) {
    return false;  // too complex for this name
  }
}

// "1700000000.000001", as candump and tcpdump write time.
std::string Time(const Json& message) {
  const auto utime = message.at("utime").get<std::int64_t>();
  std::array<char, 48> text{};
  static_cast<void>(std::snprintf(text.data(), text.size(), "%lld.%06lld",
                                  static_cast<long long>(utime / 1'000'000),
                                  static_cast<long long>(utime % 1'000'000)));
  return text.data();
}

std::string Line(const std::string& channel, const std::string& type, const Json& message) {
  Json line;
  line["channel"] = channel;
  line["type"] = type;
  line.update(message);
  return JsonLine(line) + '\n';
}

}  // namespace

std::optional<std::string> MessageWatch::On(const std::string& channel, Bytes message) {
  if (!Matches(channel_, channel)) {
    if (shown_ == 0 && others_.size() < kOthersKept) others_.insert(channel);
    return std::nullopt;
  }
  std::string type;
  const std::optional<Json> json = DecodeToJson(message, &type);
  if (!json || !json->contains("seq")) {
    ++foreign_;
    return std::nullopt;
  }
  ++shown_;
  const std::string newest = json_ ? "" : Describe(type, *json);
  Count(channel, static_cast<std::int64_t>(std::stoull(json->at("boot_id").get<std::string>(), nullptr, 16)),
        json->at("seq").get<std::int64_t>(), newest);
  if (json_) return Line(channel, type, *json);
  return Time(*json) + ' ' + Printable(channel) + "  " + newest + '\n';
}

void MessageWatch::Count(const std::string& channel, std::int64_t boot_id, std::int64_t seq,
                         const std::string& newest) {
  auto seen = channels_.find(channel);
  if (seen == channels_.end()) {
    if (channels_.size() >= kMaxChannels) {
      ++uncounted_;
      return;
    }
    seen = channels_.try_emplace(channel).first;
  }
  seen->second.sequence.On(boot_id, seq);
  seen->second.newest = newest;
}

std::vector<std::string> MessageWatch::Table(MonoNs now) {
  const MonoNs window = now - window_;
  std::vector<std::string> lines = {"CHANNEL                           /s  NEWEST"};
  for (auto& [channel, seen] : channels_) {
    if (window >= kSecond) {
      const std::int64_t received = seen.sequence.received();
      if (window_ != 0)
        seen.hz = static_cast<double>(received - seen.at_window) * 1e9 / static_cast<double>(window);
      seen.at_window = received;
    }
    lines.push_back(
        Clip(Left(Printable(channel), 28) + ' ' + Right(Decimal(seen.hz, 1), 8) + "  " + seen.newest, kRowWidth));
  }
  if (window >= kSecond) window_ = now;
  return lines;
}

std::string MessageWatch::OtherChannels() const {
  std::string text;
  std::size_t named = 0;
  for (const std::string& channel : others_) {
    if (named == kOthersNamed) return text + " and more";
    text += (named++ == 0 ? "" : ", ") + Printable(channel);
  }
  return text;
}

std::vector<std::string> MessageWatch::Losses() const {
  std::vector<std::string> lines;
  for (const auto& [channel, seen] : channels_) {
    if (seen.sequence.lost() == 0) continue;
    lines.push_back(Printable(channel) + ": " + std::to_string(seen.sequence.lost()) + " of " +
                    std::to_string(seen.sequence.lost() + seen.sequence.received()) +
                    " messages lost on the way here");
  }
  if (uncounted_ > 0) {
    lines.push_back(std::to_string(uncounted_) + " messages were of channels beyond the first " +
                    std::to_string(kMaxChannels) + ": what of those was lost was not counted");
  }
  if (foreign_ > 0) lines.push_back(std::to_string(foreign_) + " messages that are not axlecast's were not shown");
  return lines;
}

}  // namespace axlecast
