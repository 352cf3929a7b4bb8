#include "tools/axlecast/logs/log_report.h"

#include <algorithm>
#include <string_view>

#include "core/base/text.h"
#include "core/base/utc_text.h"
#include "core/messages/json/field.h"
#include "core/messages/json/message_json.h"
#include "tools/axlecast/logs/log_input.h"

namespace axlecast {
namespace {

// Returns the difference, or 0 if it overflows: a damaged log contains any times.
std::int64_t Since(std::int64_t before, std::int64_t utime) {
  std::int64_t since = 0;
  return __builtin_sub_overflow(utime, before, &since) ? 0 : since;
}

using Json = nlohmann::ordered_json;

constexpr std::string_view kRecorderHealth = "recorder_health_t";

double Seconds(std::int64_t us) { return static_cast<double>(us) / 1e6; }

// Returns the value of "machine:" in the machine's file, or an empty string.
std::string MachineName(const std::string& yaml) {
  constexpr std::string_view kKey = "machine:";
  for (std::size_t begin = 0; begin < yaml.size();) {
    const std::size_t end = std::min(yaml.find('\n', begin), yaml.size());
    const std::string_view line = std::string_view(yaml).substr(begin, end - begin);
    if (line.starts_with(kKey)) {
      const std::string_view name = line.substr(std::min(line.find_first_not_of(' ', kKey.size()), line.size()));
      return std::string(name.substr(0, name.find_first_of(" #\r")));
    }
    begin = end + 1;
  }
  return "";
}

std::string HeaderText(const LogSummary& summary) {
  const auto machine = summary.Header(kMachineChannel);
  const auto schema = summary.Header(kSchemaChannel);
  const auto recorder = summary.Header(kRecorderChannel);
  std::string text = "machine   ";
  text += machine ? Printable(MachineName(*machine)) + " (its file: " + std::to_string(machine->size()) + " bytes)"
                  : "none in the log";
  text +=
      "\nschema    " + (schema ? std::to_string(schema->size()) + " bytes of message types" : "none in the log");
  if (recorder) text += "\nrecorder  " + Printable(*recorder);
  return text + '\n';
}

std::string RecorderLosses(const LogSummary& summary) {
  std::string text;
  for (const auto& [channel, health] : summary.recorders) {
    text += Printable(channel) + ": lost " + health.at("lost").dump() + " of " + health.at("messages").dump() +
            " messages, " + health.at("kernel_dropped").dump() + " datagrams dropped by the kernel\n";
    for (const Json& sender : health.at("senders")) {
      if (sender.at("lost") == 0) continue;
      text += "  " + Printable(sender.at("sender").get<std::string>()) + ": lost " + sender.at("lost").dump() +
              " of " + sender.at("received").dump() + '\n';
    }
  }
  return text;
}

std::string ChannelLine(const std::string& name, const LogSummary::Channel& channel) {
  return Left(Printable(name), 30) + ' ' + Left(channel.type, 18) + Right(std::to_string(channel.count), 11) +
         Right(Decimal(channel.Hz(), 1), 11) + Right(std::to_string(channel.bytes), 13) +
         Right(Decimal(Seconds(channel.largest_gap), 3), 11) +
         Right(channel.type.empty() ? "-" : std::to_string(channel.sequence.lost()), 9) + '\n';
}

// Adds the decoded content of the event. Returns false if it cannot be decoded.
bool AddContent(const LogEvent& event, Json& line) {
  if (event.channel == kSealChannel) {
    const auto seal = ParseSeal(event.data);
    if (seal) line.update({{"bytes", seal->bytes}, {"events", seal->events}, {"crc32c", seal->crc32c}});
    return seal.has_value();
  }
  if (IsLogChannel(event.channel)) {
    line["text"] = std::string(event.data.begin(), event.data.end());
    return true;
  }
  std::string type;
  const auto message = DecodeToJson(event.data, &type);
  if (!message) return false;
  line["type"] = type;
  line.update(*message);
  return true;
}

constexpr std::size_t kBadSealsShown = 10;

constexpr std::uint64_t kLargestGap = 1'000'000'000'000;  // a greater gap is a damaged number

bool Follows(std::int64_t before, std::int64_t number) { return number > before && number - 1 == before; }

std::string SealText(const LogCheck::BadSeal& bad) {
  std::string text = "the seal at byte " + std::to_string(bad.offset) + " does not match: ";
  if (bad.sealed.events > bad.found.events) {
    text += std::to_string(bad.sealed.events - bad.found.events) + " of " + std::to_string(bad.sealed.events) +
            " events before it are missing\n";
  } else if (bad.sealed.events < bad.found.events) {
    text += std::to_string(bad.found.events - bad.sealed.events) + " events too many are before it\n";
  } else {
    text += "something in the " + std::to_string(bad.sealed.events) + " events before it was changed\n";
  }
  return text;
}

}  // namespace

double LogSummary::Channel::Hz() const {
  const std::int64_t span = Since(first, last);
  return span > 0 ? static_cast<double>(count - 1) * 1e6 / static_cast<double>(span) : 0;
}

void LogSummary::Add(const LogEvent& event) {
  first = events == 0 ? event.utime : std::min(first, event.utime);
  last = events == 0 ? event.utime : std::max(last, event.utime);
  ++events;
  auto found = channels.find(event.channel);
  if (found == channels.end()) found = channels.emplace(event.channel, Channel{}).first;
  Channel& channel = found->second;
  if (channel.count == 0) channel.first = event.utime;
  if (const std::int64_t gap = Since(channel.last, event.utime); channel.count > 0 && gap > channel.largest_gap) {
    channel.largest_gap = gap;
    channel.gap_at = channel.last;
  }
  channel.last = event.utime;
  ++channel.count;
  channel.bytes += EventSize(event);
  if (event.channel == kSealChannel) return;
  if (IsLogChannel(event.channel)) {
    headers.insert_or_assign(std::string(event.channel), std::string(AsText(event.data)));
    return;
  }
  const std::optional<MessageHead> head = HeadOf(event.data);
  if (!head) return;
  channel.sequence.On(head->boot_id, head->seq);
  if (!channel.type.empty() && channel.type != kRecorderHealth) return;
  std::string type;
  const auto json = DecodeToJson(event.data, &type);
  if (!json) return;
  channel.type = type;
  if (type == kRecorderHealth) recorders.insert_or_assign(std::string(event.channel), *json);
}

std::int64_t LogSummary::Lost() const {
  std::int64_t lost = 0;
  for (const auto& [name, channel] : channels) lost += channel.sequence.lost();
  return lost;
}

std::optional<std::string> LogSummary::Header(std::string_view channel) const {
  const auto found = headers.find(channel);
  return found == headers.end() ? std::nullopt : std::optional(found->second);
}

std::string SummaryText(const std::string& file, std::size_t bytes, const LogSummary& summary,
                        const std::vector<LogReader::Damage>& damage) {
  std::string text = "file      " + file + ", " + std::to_string(bytes) + " bytes\n";
  text += "events    " + std::to_string(summary.events) + '\n';
  if (summary.events == 0) return text + DamageText(file, damage);
  text += "time      " + UtcMillisecondText(summary.first) + " to " + UtcMillisecondText(summary.last) + " UTC, " +
          Decimal(Seconds(summary.last) - Seconds(summary.first), 3) + " s\n";
  text += HeaderText(summary);
  text += "damage    " + (damage.empty() ? "none"
                                         : std::to_string(damage.size()) + " places, " +
                                               std::to_string(DamagedBytes(damage)) + " bytes");
  text += "\nlost      " + std::to_string(summary.Lost()) +
          " messages before they were recorded, by their sequence numbers\n";
  text += RecorderLosses(summary) + DamageText(file, damage) + '\n';
  text += Left("CHANNEL", 30) + ' ' + Left("TYPE", 18) + Right("COUNT", 11) + Right("HZ", 11) + Right("BYTES", 13) +
          Right("GAP s", 11) + Right("LOST", 9) + '\n';
  for (const auto& [name, channel] : summary.channels) text += ChannelLine(name, channel);
  return text;
}

Json DamageJson(const std::vector<LogReader::Damage>& damage) {
  Json list = Json::array();
  for (const LogReader::Damage& piece : damage) list.push_back({{"offset", piece.offset}, {"bytes", piece.size}});
  return list;
}

Json SummaryJson(const std::string& file, std::size_t bytes, const LogSummary& summary,
                 const std::vector<LogReader::Damage>& damage) {
  Json json = {{"file", file}, {"bytes", bytes}, {"events", summary.events}};
  json["first_utime"] = summary.first;
  json["last_utime"] = summary.last;
  json["duration_s"] = Seconds(summary.last) - Seconds(summary.first);
  const auto machine = summary.Header(kMachineChannel);
  json["machine"] = machine ? Json(MachineName(*machine)) : Json(nullptr);
  json["has_schema"] = summary.Header(kSchemaChannel).has_value();
  const auto recorder = summary.Header(kRecorderChannel);
  json["recorder"] = recorder ? ParseOutsideJson(*recorder) : Json(nullptr);
  if (json["recorder"].is_discarded()) json["recorder"] = *recorder;
  json["lost"] = summary.Lost();
  json["damage"] = DamageJson(damage);
  Json& recorders = json["recorders"] = Json::object();
  for (const auto& [channel, health] : summary.recorders) recorders[channel] = health;
  Json& channels = json["channels"] = Json::array();
  for (const auto& [name, channel] : summary.channels) {
    const bool ours = !channel.type.empty();
    channels.push_back({{"channel", name},
                        {"type", ours ? Json(channel.type) : Json(nullptr)},
                        {"count", channel.count},
                        {"hz", channel.Hz()},
                        {"bytes", channel.bytes},
                        {"first_utime", channel.first},
                        {"last_utime", channel.last},
                        {"largest_gap_s", Seconds(channel.largest_gap)},
                        {"largest_gap_utime", channel.gap_at},
                        {"lost", ours ? Json(channel.sequence.lost()) : Json(nullptr)}});
  }
  return json;
}

MonoNs ArrivalOf(const LogEvent& event) {
  constexpr std::int64_t kLatest = INT64_MAX / 16 / kMicrosecond;  // a greater number is a damaged one
  return std::clamp<std::int64_t>(event.utime, 0, kLatest) * kMicrosecond;
}

std::string EventLine(const LogEvent& event, bool raw, const OnBase& base) {
  Json line = {{"number", event.number}, {"received_utime", event.utime}, {"channel", event.channel}};
  if (raw || !AddContent(event, line)) {
    line["size"] = event.data.size();
    line["data"] = HexDigits(event.data);
  } else {
    base.Add(line, ArrivalOf(event));
  }
  return JsonLine(line) + '\n';
}

void LogCheck::Add(const LogEvent& event, std::size_t offset, Bytes record) {
  ++report_.events;
  CheckNumber(event.number);
  std::int64_t back = 0;
  if (event.utime < utime_ && !__builtin_sub_overflow(utime_, event.utime, &back)) {
    ++report_.backward;
    report_.max_backward_us = std::max(report_.max_backward_us, back);
  }
  utime_ = event.utime;
  if (event.channel == kSealChannel) return CheckSeal(event, offset);
  open_.Add(record);
  if (const auto head = HeadOf(event.data)) {
    auto found = report_.sequences.find(event.channel);
    if (found == report_.sequences.end()) found = report_.sequences.emplace(event.channel, SequenceCount{}).first;
    found->second.On(head->boot_id, head->seq);
  }
}

void LogCheck::CheckNumber(std::int64_t number) {
  if (doubtful_) ResolveDoubt(number);
  if (!number_ || Follows(*number_, number)) {
    number_ = number;
  } else {
    doubtful_ = number;
  }
}

// Decides about the number that did not follow, with the help of the next one.
void LogCheck::ResolveDoubt(std::optional<std::int64_t> next) {
  const std::int64_t doubtful = *doubtful_;
  doubtful_.reset();
  const bool ahead = doubtful > *number_;
  const std::uint64_t gap = static_cast<std::uint64_t>(doubtful) - static_cast<std::uint64_t>(*number_) - 1;
  const bool confirmed = next && Follows(doubtful, *next);
  if (ahead && gap <= kLargestGap && (confirmed || !next || *next > doubtful)) {
    report_.missing += static_cast<std::int64_t>(gap);
    number_ = doubtful;
  } else if (confirmed) {
    ++report_.restarts;
    number_ = doubtful;
  } else {
    ++report_.wrong_numbers;
    if (*number_ < INT64_MAX) ++*number_;
  }
}

const LogCheck::Report& LogCheck::Finish() {
  if (doubtful_) ResolveDoubt(std::nullopt);
  report_.unsealed = static_cast<std::int64_t>(open_.seal().events);
  return report_;
}

void LogCheck::CheckSeal(const LogEvent& event, std::size_t offset) {
  ++report_.seals;
  const std::optional<LogSeal> sealed = ParseSeal(event.data);
  if (sealed != open_.seal()) {
    ++report_.bad_seals;
    if (report_.first_bad_seals.size() < kBadSealsShown) {
      report_.first_bad_seals.push_back({offset, sealed.value_or(LogSeal{}), open_.seal()});
    }
  }
  open_.Reset();
}

std::int64_t LogCheck::Report::Lost() const {
  std::int64_t lost = 0;
  for (const auto& [channel, sequence] : sequences) lost += sequence.lost();
  return lost;
}

std::string CheckText(const std::string& file, const LogCheck::Report& report,
                      const std::vector<LogReader::Damage>& damage) {
  std::string text = DamageText(file, damage);
  for (const LogCheck::BadSeal& bad : report.first_bad_seals) text += SealText(bad);
  const auto add = [&text](std::int64_t count, const std::string& what) {
    if (count > 0) text += std::to_string(count) + what + '\n';
  };
  add(report.missing, " events are missing by their numbers");
  add(report.wrong_numbers, " events have a number that fits neither neighbour: damaged");
  add(report.restarts, " times the numbers begin again: events were appended, as lcm-logger -a does");
  add(report.backward, " events are earlier than their predecessor, at most " +
                           Decimal(static_cast<double>(report.max_backward_us) / 1e6, 6) + " s");
  for (const auto& [channel, sequence] : report.sequences) {
    add(sequence.lost(), " messages of " + Printable(channel) + " were lost before they were recorded");
  }
  text += file + ": " + std::to_string(report.events) + " events, ";
  if (report.seals == 0) {
    text += "no seals: changed content cannot be detected";
  } else {
    text += std::to_string(report.seals - report.bad_seals) + " of " + std::to_string(report.seals) +
            " seals match, " + std::to_string(report.unsealed) + " events are after the last one";
  }
  return text + (damage.empty() && report.IsSound() ? "; complete\n" : "; readable with losses\n");
}

nlohmann::ordered_json CheckJson(const std::string& file, const LogCheck::Report& report,
                                 const std::vector<LogReader::Damage>& damage) {
  nlohmann::ordered_json lost = nlohmann::ordered_json::object();
  for (const auto& [channel, sequence] : report.sequences) {
    if (sequence.lost() > 0) lost[channel] = sequence.lost();
  }
  nlohmann::ordered_json bad = nlohmann::ordered_json::array();
  for (const LogCheck::BadSeal& seal : report.first_bad_seals) {
    bad.push_back(
        {{"offset", seal.offset}, {"events_sealed", seal.sealed.events}, {"events_found", seal.found.events}});
  }
  return {{"file", file},
          {"whole", damage.empty() && report.IsSound()},
          {"events", report.events},
          {"damage", DamageJson(damage)},
          {"seals", report.seals},
          {"bad_seals", report.bad_seals},
          {"first_bad_seals", bad},
          {"unsealed_events", report.unsealed},
          {"missing_events", report.missing},
          {"wrong_numbers", report.wrong_numbers},
          {"new_beginnings", report.restarts},
          {"backward", report.backward},
          {"max_backward_us", report.max_backward_us},
          {"lost", lost}};
}

}  // namespace axlecast
