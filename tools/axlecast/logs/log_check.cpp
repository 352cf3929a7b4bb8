#include "tools/axlecast/logs/log_check.h"

#include <algorithm>

#include "core/base/text.h"
#include "core/messages/json/message_json.h"
#include "tools/axlecast/logs/log_input.h"
#include "tools/axlecast/logs/log_summary.h"

namespace axlecast {
namespace {

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
